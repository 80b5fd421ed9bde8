"""Other models fitted to the same measurements with the same care: what the project's own is held against."""

from mrctl.identify.baselines.fit import BASELINES, fit_baselines
from mrctl.identify.baselines.result import BaselineFit, Quantity

__all__ = ["BASELINES", "BaselineFit", "Quantity", "fit_baselines"]
