"""Draws `signs.png`, the figure of the sign convention. Run it from this folder."""

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Arc, FancyArrowPatch, Wedge


def arrow(axes, start, end, colour, style="-|>"):
    axes.add_patch(
        FancyArrowPatch(
            start,
            end,
            arrowstyle=style,
            mutation_scale=16,
            color=colour,
            lw=1.8,
            zorder=5,
        )
    )


def main() -> None:
    figure = Figure(figsize=(7.2, 6.4), layout="constrained")
    axes = figure.subplots()
    n = 10
    wrap = 270.0
    rim = 1.0
    band = 1.18
    # slack end, degrees; the pulley runs onto the band at the tight end, lower right,
    # and over the top
    first = 225.0
    axes.add_patch(Wedge((0, 0), rim, 0, 360, width=0.12, color="0.8"))
    theta = np.radians(np.linspace(first, first - wrap, 300))
    axes.plot(band * np.cos(theta), band * np.sin(theta), color="tab:blue", lw=3)
    for i in range(n):
        high = first - i * wrap / n - 2
        low = first - (i + 1) * wrap / n + 2
        axes.add_patch(
            Wedge((0, 0), 1.15, low, high, width=0.14, color="tab:orange", alpha=0.85)
        )
        middle = math.radians((low + high) / 2)
        axes.text(
            1.08 * math.cos(middle),
            1.08 * math.sin(middle),
            str(i + 1),
            ha="center",
            va="center",
            fontsize=9,
        )
    for angle, direction, name, side in (
        (first, +1, "$T_0$  (lever)", "slack end"),
        (first - wrap, -1, "$T_n = C\\,x$  (anchor)", "tight end"),
    ):
        a = math.radians(angle)
        start = np.array([band * math.cos(a), band * math.sin(a)])
        tangent = direction * np.array([-math.sin(a), math.cos(a)])
        end = start + 0.55 * tangent
        axes.plot(
            *zip(start, start + 0.3 * tangent, strict=True), color="tab:blue", lw=3
        )
        arrow(axes, start + 0.2 * tangent, end, "tab:blue")
        axes.text(
            end[0],
            end[1] - 0.1,
            f"{name}\n{side}",
            ha="center",
            va="top",
            color="tab:blue",
            fontsize=11,
        )
    axes.add_patch(Arc((0, 0), 1.1, 1.1, theta1=55, theta2=125, color="k", lw=1.8))
    arrow(axes, (-0.275, 0.476), (-0.36, 0.415), "k")
    axes.text(
        0, 0.62, r"$\omega > 0$, $\varphi$, $M_\mathrm{load}$", ha="center", fontsize=11
    )
    axes.add_patch(
        Arc((0, 0), 0.62, 0.62, theta1=230, theta2=310, color="tab:red", lw=1.8)
    )
    arrow(axes, (-0.15, -0.27), (-0.235, -0.2), "tab:red")
    axes.text(
        0,
        -0.47,
        r"brake torque $M_b = R_b\,(T_n - T_0)$",
        ha="center",
        color="tab:red",
        fontsize=11,
    )
    axes.plot(
        [0, band * math.cos(math.radians(160))],
        [0, band * math.sin(math.radians(160))],
        color="0.4",
        lw=0.9,
    )
    axes.text(-0.5, 0.26, "$R_b$", color="0.3", fontsize=11)
    a = math.radians(90)
    arrow(
        axes,
        (band * math.cos(a) + 0.25, 1.32),
        (band * math.cos(a) - 0.25, 1.32),
        "tab:green",
    )
    axes.text(
        0,
        1.4,
        r"band moves at $\dot x$, linings slip at $v_s = R_b\,\omega - \dot x$",
        ha="center",
        color="tab:green",
    )
    axes.set_aspect("equal")
    axes.set_xlim(-1.6, 1.6)
    axes.set_ylim(-1.75, 1.55)
    axes.axis("off")
    figure.savefig(Path(__file__).with_name("signs.png"), dpi=110)


if __name__ == "__main__":
    main()
