"""Write runs/results.csv, as a multibody program would: `python runs/results_rows.py`.

A slider crank at 60 deg with an offset of its guide. A formula stands for the program.
"""

from pathlib import Path

import numpy as np

ROWS = 2000


def main() -> None:
    """Sample the inputs, evaluate the formula, write a row for each."""
    random = np.random.default_rng(2026)
    crank = random.normal(50, 0.1 / 3, ROWS).round(4)  # mm
    rod = random.normal(150, 0.2 / 3, ROWS).round(4)
    offset = random.uniform(-0.2, 0.2, ROWS).round(4)
    phi = np.deg2rad(60)
    across = crank * np.sin(phi) - offset
    reach = crank * np.cos(phi) + np.sqrt(rod**2 - across**2)
    force = 3 + 0.4 * (crank - 50) + 0.2 * offset**2 + random.normal(0, 0.004, ROWS)
    lines = ["run;crank [mm];rod [mm];offset [mm];reach [mm];F peak [kN];state"]
    for i in range(ROWS):
        answer = f"{reach[i]:.5f};{force[i]:.5f};ok"
        if i % 900 == 450:  # the program gave up
            answer = ";;not converged"
        lines.append(f"{i + 1};{crank[i]:.4f};{rod[i]:.4f};{offset[i]:.4f};{answer}")
    text = "\n".join(lines) + "\n"
    Path(__file__).with_name("results.csv").write_text(text)


if __name__ == "__main__":
    main()
