"""Writes the chi-square tables that test_statistics.cpp compares with: python golden_statistics.py"""

from pathlib import Path

from scipy.stats import chi2

HERE = Path(__file__).parent
DOFS = [1, 2, 3, 4, 5, 6, 9, 12, 15, 21, 30, 50, 75, 100, 150, 200, 250, 300]

rows = []
for dof in DOFS:
    deviation = (2 * dof) ** 0.5
    points = [
        1e-6,
        0.01,
        0.3 * dof,
        0.7 * dof,
        dof,
        dof + 1,
        dof + deviation,
        dof + 3 * deviation,
        dof + 8 * deviation,
        3 * dof + 100,
    ]
    for x in points:
        cdf, survival = chi2.cdf(x, dof), chi2.sf(x, dof)
        if cdf > 1e-290 and survival > 1e-290:
            rows.append(f"{{{dof}, {x!r}, {float(cdf)!r}, {float(survival)!r}}},\n")
(HERE / "golden_chi_square.inc").write_text("".join(rows))

rows = []
for dof in DOFS:
    for p in [1e-12, 1e-4, 0.025, 0.05, 0.3, 0.5, 0.7, 0.95, 0.975, 0.99, 0.9973, 0.99999, 1 - 2.0**-30]:
        # Above one half through the upper tail, where SciPy keeps its digits; 1 - p is exact there.
        x = chi2.ppf(p, dof) if p <= 0.5 else chi2.isf(1 - p, dof)
        rows.append(f"{{{p!r}, {dof}, {float(x)!r}}},\n")
(HERE / "golden_chi_square_quantile.inc").write_text("".join(rows))
