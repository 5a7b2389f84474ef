"""Codes of the column ``status``, which says if a point's measurement is valid, for all systems.

Kernels raise no errors; they give each point a status. Maps store the numbers, so they never change: a new
status is added at the end. Nothing is imported here, so that the names can be read before any compiler is.
"""

STATUSES = (
    *("ok", "short_window", "not_converged", "non_finite", "no_equilibrium", "flat", "not_perturbed"),
    *("too_many_equilibria", "kinetic_energy_not_positive", "perturbation_too_large", "not_excited"),
    *("equilibrium_undecided", "no_periodic_motion", "no_time_scale", "not_found"),
)

OK, SHORT_WINDOW, NOT_CONVERGED, NON_FINITE, NO_EQUILIBRIUM, FLAT, NOT_PERTURBED = range(7)
TOO_MANY_EQUILIBRIA, KINETIC_ENERGY_NOT_POSITIVE, PERTURBATION_TOO_LARGE, NOT_EXCITED = range(7, 11)
EQUILIBRIUM_UNDECIDED, NO_PERIODIC_MOTION, NO_TIME_SCALE, NOT_FOUND = range(11, len(STATUSES))
