"""Rounding at the extremes: the field solver against 60 digits, and naive formulas beside ours.

    python bench/stability.py

Columns: worst error of the four guide potentials relative to the supply, relative errors of the contact's conductance
and of its polarisability, condition of the scaled system, and what the textbook's way makes of the same case: the Green
function without expm1 (nor closed-form images, so that its aliasing, 1e-9 to 1e-2, shows as well), and the guides from
the 4 x 4 matrix Y instead of the structured elimination.
"""

from report import head

from tests.support.field.extremes import ORDER, POINTS, extreme_cases, measure, scale_errors


def main() -> None:
    print(f"{head('numpy', 'mpmath')}; M = {ORDER}, N = {POINTS} in both\n")
    columns = ("|dV|/U0", "dG/G", "dP/P", "cond", "naive Green", "via Y")
    print(f"{'':28}" + "".join(f"{column:>12}" for column in columns))
    worst = 0.0
    for case in extreme_cases():
        r = measure(case)
        worst = max(worst, r.volts)
        row = (r.volts, r.conductance, r.excess, r.condition, r.naive_green, r.naive_y)
        print(f"{case.name:28}" + "".join(f"{'lost' if v > 1e100 else format(v, '.1e'):>12}" for v in row), flush=True)
    print(f"\nworst |dV|/U0 of ours: {worst:.1e}")
    print(
        "a disc 1e-12 of its room from an edge has a gap that its radius, in doubles, fixes to 1e-4: that is its error"
    )
    print("\nslant distance from the potential, relative error:  W/r1   equation 20   ours")
    for ratio in (1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9):
        naive, ours = scale_errors(ratio)
        print(f"{ratio:57.0e}   {naive:11.1e}   {ours:.1e}")


if __name__ == "__main__":
    main()
