"""The paper's method from end to end: measurements in, a damper and every step on the way out."""

from __future__ import annotations

from dataclasses import dataclass

from mrctl.errors import Problem
from mrctl.identify.inverse_filter import design_inverse_filter
from mrctl.identify.paper.backbone import Backbones, backbones
from mrctl.identify.paper.conditions import Conditions, conditions
from mrctl.identify.paper.fir import AdaptiveFilters, adaptive_filters
from mrctl.identify.paper.lower_order import LowerOrder, lower_order
from mrctl.identify.paper.options import PaperOptions
from mrctl.identify.paper.prepare import Preparation, prepare
from mrctl.identify.paper.response import Responses, responses
from mrctl.identify.paper.separable import (
    Collapse,
    Estimate,
    Temperature,
    collapse,
    estimate,
    temperature_correction,
)
from mrctl.identify.paper.tables import model_tables
from mrctl.identify.paper.validation import ForwardErrors, InverseErrors, forward_errors, inverse_errors
from mrctl.measurements.run import Campaign
from mrctl.model.damper import Damper, Span
from mrctl.model.filters import Filter
from mrctl.model.static import StaticTables


@dataclass(frozen=True, slots=True, eq=False)
class PaperSteps:
    """What each step found, in the paper's order."""

    preparation: Preparation  # Sec. 5.1
    backbones: Backbones  # Sec. 5.2
    conditions: Conditions  # the currents and temperatures of the runs
    collapse: Collapse  # Sec. 5.3, 5.5: g and f
    temperature: Temperature  # Sec. 5.4: h
    estimate: Estimate  # Sec. 5.6
    tables: StaticTables  # Eq. 5.2, as the calibration has it
    filters: AdaptiveFilters  # Sec. 6.2
    responses: Responses  # Eq. 6.3
    lower_order: LowerOrder  # Eq. 6.4, 6.5
    inverse_filter: Filter  # Sec. 8.1
    forward_errors: ForwardErrors  # Ch. 7
    inverse_errors: InverseErrors  # Sec. 9.2


@dataclass(frozen=True, slots=True, eq=False)
class PaperResult:
    """The damper that the paper's method finds, how it got there, and what a person should know of it.

    notes: what was assumed or could not be found; left_out: the runs that the method cannot use, and why.
    """

    damper: Damper
    steps: PaperSteps
    notes: tuple[str, ...]
    left_out: tuple[Problem, ...]


def identify_paper(campaign: Campaign, options: PaperOptions | None = None) -> PaperResult:
    """Identify a damper as the paper does (Ch. 5, 6 and 8) and check it as the paper does (Ch. 7, Sec. 9.2).

    Raises InputError where the campaign lacks what the method needs: runs at constant currents, of two
    levels at least.
    """
    options = options or PaperOptions()
    preparation = prepare(campaign, options)
    curves = backbones(preparation, options.bins)
    at = conditions(preparation, curves)
    collapsed = collapse(curves, at)
    h = temperature_correction(curves, at, collapsed)
    tables, notes = model_tables(preparation, curves, at, collapsed, h)
    filters = adaptive_filters(preparation, curves, options)
    found = responses(preparation, curves, filters, options.cutoff_hz)
    low = lower_order(found, preparation.sample_rate_hz)
    inverse = design_inverse_filter(low.iir)
    top = float(tables.current_a[-1]) if options.current_max_a is None else options.current_max_a
    steps = PaperSteps(
        preparation=preparation,
        backbones=curves,
        conditions=at,
        collapse=collapsed,
        temperature=h,
        estimate=estimate(curves, at, collapsed, h),
        tables=tables,
        filters=filters,
        responses=found,
        lower_order=low,
        inverse_filter=inverse,
        forward_errors=forward_errors(preparation, tables, low.iir, low.lowpass, filters),
        inverse_errors=inverse_errors(preparation, tables, low.iir, inverse, top),
    )
    return PaperResult(_damper(steps, top, options), steps, (*notes, *filters.notes), preparation.left_out)


def _damper(steps: PaperSteps, current_max_a: float, options: PaperOptions) -> Damper:
    t = steps.tables
    return Damper(
        static=t,
        forward_filter=steps.lower_order.iir,
        inverse_filter=steps.inverse_filter,
        refine_cutoff_hz=None,  # the paper has no refinement
        current_max_a=current_max_a,
        current_slew_a_s=options.current_slew_a_s,
        velocity_valid_m_s=Span(t.velocity_m_s[0], t.velocity_m_s[-1]),
        temperature_valid_c=Span(t.temperature_c[0], t.temperature_c[-1]),
        current_valid_a=Span(max(0.0, float(steps.conditions.current_a[0])), t.current_a[-1]),
    )
