"""Physical effects beyond the separable model, one file each; `registry` finds them."""
