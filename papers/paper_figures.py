"""Figures of the papers recomputed from their formulas, and figures of their tables,
with the printed numbers."""

import pathlib
from collections.abc import Callable, Iterable
from typing import Any

import jax.numpy as jnp
import matplotlib
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from printed_tables import (
    AGREES,
    S1_PAIR,
    band_diagrams,
    cells,
    chord_curves,
    energy_levels,
    overlap_stop,
    published_rows,
)

import simbrake as sb
from simbrake.design.formulas import transmission_table
from simbrake.thermal import axial_resistance, radial_resistance

ZERO = 273.15  # K
#: colours distinguishable with any colour vision (M. Okabe, K. Ito, *Color Universal
#: Design*, 2008)
BLUE = "#0072B2"
SKY = "#56B4E9"
GREEN = "#009E73"
ORANGE = "#E69F00"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
TEXT = 12.0  # pt, for a figure that is printed at half of its size
STYLE: Any = {
    "font.size": TEXT,
    "axes.titlesize": TEXT,
    "figure.titlesize": TEXT,
    "axes.prop_cycle": cycler(color=(BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY)),
    "axes.formatter.useoffset": False,
}
_RING: dict[str, Any] = {
    "ms": 12,
    "mfc": "none",
    "mec": VERMILLION,
    "ls": "",
    "marker": "o",
}


def published(name: str, *, figure: Figure | None = None) -> Figure:
    """A figure of the papers, or the figure of a table, recomputed; printed numbers are
    points, misprints ringed.

    - `name`: `"Z Fig. 4"` angles of equal loads, `"Z Fig. 5"` tension and load along
      the band, `"S Fig. 1"` energy levels, `"K Fig. 5"` overlap coefficients (simulates
      two stops), `"V table 1"`, `"V table 2"`, `"S table 1"`

    The other figures of the papers are drawings and measurements. Raises `ValueError`
    for another name.

    """
    if name not in PUBLISHED:
        raise ValueError(
            f"{name!r} is not a figure that a formula gives: one of {list(PUBLISHED)}"
        )
    draw, size = PUBLISHED[name]
    with matplotlib.rc_context(STYLE):
        if figure is None:
            figure = Figure(figsize=size, layout="constrained")
        draw(figure)
    for axes in figure.axes:
        # further ticks are made when the figure is written
        axes.tick_params(which="both", labelsize=TEXT)
    return figure


def file_stem(name: str) -> str:
    """A name for the file of a figure: `"Z Fig. 4"` is `z_fig_4`."""
    return name.lower().replace(".", "").replace(" ", "_")


def _z_fig_4(figure: Figure) -> None:
    *panels, legend = figure.subplots(2, 3).ravel()
    printed = {float(row["f"]): row for row in published_rows("Z1")}
    colours = {0.1: BLUE, 0.3: GREEN, 0.5: VERMILLION, 0.2: SKY, 0.4: ORANGE}
    for f, colour in colours.items():
        curves = chord_curves(f)
        more = "" if f in (0.1, 0.3, 0.5) else ", in table 1 only"
        last = np.degrees(curves.last)
        angle = np.degrees(curves.angle)
        drawn: dict[str, Any] = (
            {"ls": "--", "lw": 1.0} if more else {"ls": "-", "lw": 1.8}
        )
        label = rf"$f$ = {f:g}, exists up to $\beta_7$ = {last[-1]:.1f}°{more}"
        for i, panel in enumerate(panels):
            panel.plot(last, angle[:, i], color=colour, label=label, **drawn)
            panel.plot(last[-1], angle[-1, i], color=colour, marker="|", ms=8)
            if f in printed:
                where = float(printed[f][f"beta{i + 1}_deg"])
                panel.plot(
                    20.0, where, color=colour, marker="o", ms=6, mec="black", ls=""
                )
    for panel, number in zip(panels, "12345", strict=True):
        panel.set(xlabel=r"$\beta_7 = \beta_6$, °", ylabel=rf"$\beta_{number}$, °")
        panel.grid(alpha=0.3)
    lines, labels = panels[0].get_legend_handles_labels()
    points = panels[0].plot([], [], marker="o", ms=6, color="white", mec="black", ls="")
    legend.axis("off")
    legend.legend([*lines, *points], [*labels, "printed in table 1"], loc="center")
    figure.suptitle(
        "Z, Fig. 4: chord angles of equal loads over the last angle ($k$ = 7, $\\beta_0$ = 0)"
    )


def _z_fig_5(figure: Figure) -> None:
    diagrams = band_diagrams()
    figure.set_layout_engine("none")  # the layout engine ignores labels around a circle
    room = {"left": 0.06, "right": 0.94, "top": 0.78, "bottom": 0.22}
    for axes, d in zip(
        figure.subplots(1, 2, subplot_kw={"projection": "polar"}, gridspec_kw=room),
        diagrams,
        strict=True,
    ):
        ends = np.append(0.0, np.cumsum(d.angle))
        middle = 0.5 * (ends[:-1] + ends[1:])
        fill: dict[str, Any] = {"alpha": 0.55, "ec": "black", "lw": 0.6}
        axes.bar(
            middle,
            d.normal,
            0.86 * d.angle,
            color=GREEN,
            label="load of a lining $N_i/T_0$",
            **fill,
        )
        around = np.linspace(0.0, ends[-1], 2000)
        on = np.minimum(np.searchsorted(ends, around, side="right"), len(d.angle))
        axes.plot(
            around,
            d.tension[on],
            color=BLUE,
            lw=1.8,
            label="tension behind a lining $T_i/T_0$",
        )
        loads = f"loads {d.normal.min():.2f}…{d.normal.max():.2f} $T_0$"
        axes.set_title(f"{d.name}\n$T_n/T_0$ = {d.tension[-1]:.3f}, {loads}", y=1.2)
        numbers = zip(d.tension[1:], d.normal, strict=True)
        axes.set_xticks(
            middle, [f"{i}\n{T:.2f}\n{N:.2f}" for i, (T, N) in enumerate(numbers, 1)]
        )
        axes.tick_params(axis="x", pad=16.0)
        axes.set_rlim(0, 5.2)
        axes.set_rorigin(-1.8)  # the hole is the pulley
        axes.set_rticks([1, 2, 3, 4])
        axes.set_rlabel_position(300)
        axes.grid(alpha=0.4)
    lines, labels = figure.axes[0].get_legend_handles_labels()
    words = (
        "Z, Fig. 5: $k$ = 10, $f$ = 0.3, $w_0$ = 1.5, $\\lambda$ = 5.08; at each "
        "lining its number from the slack end, "
    )
    words += "$T_i/T_0$, $N_i/T_0$"
    figure.legend(
        lines, labels, loc="lower center", ncols=2, title=words, frameon=False
    )


def _s_fig_1(figure: Figure) -> None:
    stop, drag = energy_levels()
    share, rise = figure.subplots(2, 2, sharex="col")
    for above, below, levels in zip(share, rise, (stop, drag), strict=True):
        above.plot(levels.time, levels.power, color=VERMILLION, label="power $N/N_m$")
        above.plot(levels.time, levels.work, color=BLUE, ls="--", label="work $W/W_T$")
        below.plot(
            levels.time,
            levels.maximum,
            color=VERMILLION,
            label="maximum, S-26 ($t_s + t_f/3$)",
        )
        below.plot(levels.time, levels.surface, color=ORANGE, label="surface $t_s$")
        below.plot(levels.time, levels.bulk, color=GREEN, ls="--", label="bulk $t_v$")
    share[0].set_title("a: a stop, power falls linearly")
    share[1].set_title("b: a drag at a tenth of that power")
    share[0].set_ylabel("share (–)")
    rise[0].set(xlabel=r"relative time $\tau/\tau_T$ (–)", ylabel="temperature rise, K")
    rise[1].set_xlabel(r"time $\tau$, s")
    finish([*share, *rise])
    f = S1_PAIR["f_0"]
    v = S1_PAIR["V_0"]
    p = S1_PAIR["p_c"] / 1e6
    area = S1_PAIR["A_c"]
    figure.suptitle(
        f"S, Fig. 1, our reading: rim of V, $f_0$ = {f:g}, $V_0$ = {v:g} m/s, $p_c$ = "
        f"{p:g} MPa, $A_c$ = {area:g} m²"
    )


def _k_fig_5(figure: Figure) -> None:
    panels = figure.subplots(2, 2, sharex="col", sharey=True)
    for column, (external, internal) in enumerate([(0.42, 0.30), (0.30, 0.42)]):
        run = sb.simulate(overlap_stop(external, internal))
        moving = [stage for stage in run.stages if stage.name not in ("held", "open")]
        t = np.linspace(0.0, moving[-1].end * (1 - 1e-9), 500)
        o = sb.results.overlap(run, t, sb.results.RunningIn(start=0.6, work=1.5e5))
        for axes, pair, dynamic, static in (
            (panels[0, column], "external", o.external_dynamic, o.external_static),
            (panels[1, column], "internal", o.internal_dynamic, o.internal_static),
        ):
            axes.plot(t, dynamic, color=VERMILLION, label="dynamic: the pair slides")
            axes.plot(t, static, color=BLUE, ls="--", label="static: the pair sticks")
            for stage in moving[1:]:
                axes.axvline(stage.start, color="black", lw=0.6)
            for stage in moving:
                words = (
                    stage.name.replace("_", " ")
                    if stage.duration > 0.16 * t[-1]
                    else stage.name[-1]
                )
                axes.text(0.5 * (stage.start + stage.end), 0.84, words, ha="center")
            axes.set_ylim(-0.03, 0.92)
            axes.set_ylabel(f"{pair} pair" if column == 0 else "")
        panels[0, column].set_title(
            f"friction: external {external:g}, internal {internal:g}"
        )
        panels[1, column].set_xlabel("time, s")
        for axes in panels[:, column]:
            axes.grid(alpha=0.3)
    lines, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(lines, labels, loc="outside lower center", ncols=2)
    figure.supylabel("share of the track that a pair covers")
    figure.suptitle(
        "K, Fig. 5, our reading: overlap coefficients of a staged brake in a stop"
    )


def _on_log_axes(axes: Axes, ticks: list[int], **words: str) -> None:
    axes.plot([], [], "o", color="0.4", ms=5, label="printed")
    axes.set(xscale="log", yscale="log", **words)  # pyright: ignore
    axes.set_xticks(ticks, [str(tick) for tick in ticks])
    axes.minorticks_off()
    finish([axes])


def _v_table_1(figure: Figure) -> None:
    axes = figure.subplots()
    rows = [row for row in published_rows("V1") if row["element"] != "total"]
    conductivity = np.geomspace(40.0, 200.0, 50)
    names = list(dict.fromkeys(row["element"] for row in rows))
    for name, colour in zip(names, (BLUE, ORANGE, GREEN, PURPLE, SKY), strict=True):
        of = [row for row in rows if row["element"] == name]
        r, R, L = (float(of[0][column]) for column in ("r_m", "R_m", "L_m"))
        law = axial_resistance if of[0]["direction"] == "axial" else radial_resistance
        label = f"{name.replace('rebord', 'rim lip').replace('_', ' ')}, {of[0]['direction']}"
        axes.plot(conductivity, law(L, conductivity, r, R), color=colour, label=label)
        printed = [float(row["resistance"]) for row in of]
        axes.plot(
            [float(row["lambda_W_mK"]) for row in of], printed, "o", color=colour, ms=5
        )
    words = {
        "xlabel": r"conductivity $\lambda$, W/(m·K)",
        "ylabel": "thermal resistance, K/W",
    }
    _on_log_axes(
        axes,
        [40, 50, 80, 110, 160, 200],
        title="V, table 1: parts of the pulley",
        **words,
    )


def _v_table_2(figure: Figure) -> None:
    law = transmission_table()
    rows = published_rows("V2")
    T = np.linspace(law.temperature[0], law.temperature[-1], 400)
    K = [np.asarray(K) for K in law.transmissions(jnp.asarray(T))]
    wrong = {
        (c.row, c.column) for c in cells() if c.table == "V2" and c.verdict != AGREES
    }
    at = np.asarray([float(row["T_polished_C"]) for row in rows])
    coefficient, share = figure.subplots(1, 2)
    for axes, curves, columns, words in (
        (
            coefficient,
            K,
            ("K1", "K2"),
            ("into the metal $K_1$", "into the lining $K_2$"),
        ),
        (
            share,
            (K[0] / (K[0] + K[1]), K[1] / (K[0] + K[1])),
            ("share_metal", "share_lining"),
            ("metal", "lining"),
        ),
    ):
        ringed = []
        for curve, column, word, colour in zip(
            curves, columns, words, (BLUE, ORANGE), strict=True
        ):
            axes.plot(T - ZERO, curve, color=colour, label=word)
            printed = np.asarray([float(row[column]) for row in rows])
            axes.plot(at, printed, "o", color=colour, ms=5)
            ringed += [
                (at[i], printed[i]) for i in range(len(rows)) if (i, column) in wrong
            ]
        axes.plot([], [], "o", color="0.4", ms=5, label="printed")
        if ringed:
            axes.plot(*zip(*ringed, strict=True), **_RING, label="known misprint")
        axes.set_xlabel("temperature of the polished surface, °C")
    coefficient.set_ylabel("heat transmission, W/(m²·K)")
    share.set(ylabel="share of the friction heat (–)", ylim=(0, 1))
    finish([coefficient, share])
    figure.suptitle(
        "V, table 2: heat transmission to both sides of the friction surface"
    )


def _s_table_1(figure: Figure) -> None:
    axes = figure.subplots()
    found = [c for c in cells() if c.table == "S1"]
    rows = published_rows("S1")
    groups = list(dict.fromkeys((row["part"], row["material"]) for row in rows))
    for (part, of), colour, marker in zip(
        groups, (BLUE, VERMILLION, SKY, ORANGE), "osD^", strict=True
    ):
        chosen = [
            c
            for c in found
            if (rows[c.row]["part"], rows[c.row]["material"]) == (part, of)
        ]
        depth = np.asarray([float(rows[c.row]["delta_mm"]) for c in chosen])
        # B falls with the square of the depth: between two points of the formula it is
        # a straight line here
        fine = np.geomspace(depth[0], depth[-1], 50)
        label = f"{part}, {of.replace('_', ' ')}: {'$10^3 B$' if part == 'rim' else '$B$'}, 1/s"
        axes.plot(
            fine, chosen[0].computed * (depth[0] / fine) ** 2, color=colour, label=label
        )
        axes.plot(depth, [c.printed for c in chosen], marker, color=colour, ms=5)
    words = {"xlabel": r"depth $\delta$, mm", "ylabel": "parameter $B$ as printed, 1/s"}
    _on_log_axes(
        axes,
        [1, 2, 5, 10, 20, 50, 80],
        title="S, table 1: parameter of the Fourier number",
        **words,
    )


#: available figures: function and size (inch)
PUBLISHED: dict[str, tuple[Callable[[Figure], None], tuple[float, float]]] = {
    "Z Fig. 4": (_z_fig_4, (11.0, 6.5)),
    "Z Fig. 5": (_z_fig_5, (12.5, 8.0)),
    "S Fig. 1": (_s_fig_1, (11.0, 6.0)),
    "K Fig. 5": (_k_fig_5, (11.0, 5.4)),
    "V table 1": (_v_table_1, (8.0, 5.6)),
    "V table 2": (_v_table_2, (11.0, 5.4)),
    "S table 1": (_s_table_1, (8.0, 5.6)),
}


def finish(panels: Iterable[Axes]) -> None:
    """Grids, and a legend above each panel, so that it covers nothing."""
    for panel in panels:
        panel.grid(alpha=0.3)
        names = panel.get_legend_handles_labels()[1]
        columns = 1 if max(map(len, names)) > 24 else 2
        place: dict[str, Any] = {
            "ncols": columns,
            "frameon": False,
            "labelspacing": 0.15,
        }
        panel.legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1, **place
        )
        if panel.get_title():
            panel.set_title(
                panel.get_title(), pad=6.0 + 1.35 * TEXT * -(-len(names) // columns)
            )


def write(folder: pathlib.Path) -> list[pathlib.Path]:
    """Write every figure as PNG."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name in PUBLISHED:
        file = folder / f"{file_stem(name)}.png"
        published(name).savefig(file, dpi=130)
        written.append(file)
    return written
