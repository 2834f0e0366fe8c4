"""Files of a view (view.py): its results, its figure, Python code that computes the view, and its motion as CSV."""

from __future__ import annotations

import tempfile
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrodrive.batch.trajectory import Trajectory
from vibrodrive.explorer.controls import symbol
from vibrodrive.explorer.image import round_numbers
from vibrodrive.explorer.layout import CURVES, LOOKS, ODD, Page
from vibrodrive.explorer.shown import Picture, place, title_of
from vibrodrive.explorer.view import BESIDE, DIFFERENCE, View
from vibrodrive.model import config
from vibrodrive.model.drawing import MAP
from vibrodrive.model.names import LINEAR, LOG, SCENE
from vibrodrive.model.parameters import bad
from vibrodrive.model.results import Results
from vibrodrive.model.size import file_bytes, human
from vibrodrive.model.states import State
from vibrodrive.store.layout import Origin
from vibrodrive.store.writer import open_writer

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

POINTS = 100  # points of a motion in a CSV file, per excitation period
LARGEST_FILE = 200_000_000  # largest number of bytes that a page downloads


def file_name(view: View, kind: str) -> str:
    """Return a file name that describes the content: "dxi_over_A_2.4_3.25.png", "motion_at_A_3.04.csv"."""
    if kind == "csv":
        parts = ["motion", "at", view.x, f"{view.at:.6g}"]
    else:
        shown = view.shade if view.mode == MAP else view.quantity
        parts = [shown, "over", view.x, f"{view.low:.6g}", f"{view.high:.6g}"]
        parts += [view.y, f"{view.y_low:.6g}", f"{view.y_high:.6g}"] if view.mode == MAP else []
    if view.method != "certified":
        parts += [view.method, f"{view.dtau:.6g}"]
    if view.compared and kind in ("png", "pdf", "svg"):  # all other files contain only the chosen method
        parts += [{DIFFERENCE: "minus", BESIDE: "and"}[view.compare], "certified"]
    parts += ["eps", f"{view.eps:.6g}"] if view.eps and "eps" not in view.axes else []
    return "_".join(parts) + "." + kind


DPI = 100
LEFT, RIGHT, BELOW, ABOVE = 80, 20, 55, 25  # pixels around each diagram
BAR = 110  # pixels for the scale of a map
LINE = 20  # pixels for a line of text
MOTION_ROWS = 220  # height in pixels of the curves of a motion
CELL = 500  # approximate width in pixels of a picture with fewer columns; each of its cells becomes a block


def drawn(view: View, picture: Picture, page: Page, kind: str) -> bytes:
    """Return the picture, the exact curves and the motion of a page as "png", "pdf" or "svg".

    A PNG contains the pixels of the picture unchanged, or each cell of a map as a block of pixels. The other formats
    contain the picture as an embedded image of these pixels.
    """
    from matplotlib.colors import to_rgb  # imported here so that the page appears sooner
    from matplotlib.figure import Figure

    from vibrodrive.figures.style import defaults_and, save

    cells = picture.palette[picture.images[0]].shape
    block = max(1, round(CELL / cells[1]))
    up = block if view.mode == MAP else 1  # a diagram has the rows of the page, and possibly few columns
    height, width = up * cells[0], block * cells[1]
    over, conditions = title_of(view)
    title = [over, *textwrap.wrap(conditions, width // 7)]
    moving = len(page.motion.data["time"]) > 0 and view.follows
    key = _key(picture, page, moving)
    columns = max(1, width // 170)
    foot = LINE * -(-len(key) // columns)
    tall = len(title) * LINE + len(picture.images) * (ABOVE + height + BELOW) + foot
    tall += ABOVE + MOTION_ROWS + BELOW if moving else 0
    wide = LEFT + width + RIGHT + (BAR if picture.key.scale else 0)
    with defaults_and({"svg.fonttype": "path", "svg.hashsalt": "vibrodrive", "pdf.fonttype": 42, "font.size": 10}):
        fig = Figure(figsize=(wide / DPI, tall / DPI), dpi=DPI)

        def axes(left: int, top: int, width: int, height: int) -> Axes:
            return fig.add_axes((left / wide, 1 - (top + height) / tall, width / wide, height / tall))

        fig.text(LEFT / wide, 1 - 4 / tall, "\n".join(title), va="top")
        top = len(title) * LINE + ABOVE
        for index, image in enumerate(picture.images):
            ax = axes(LEFT, top, width, height)
            _show(ax, view, picture, np.kron(image, np.ones((up, block), image.dtype)))
            if index == 0:
                _lay_over(ax, page)
            if len(picture.images) > 1:
                ax.set_title("certified" if index else view.method, size=10)
            if moving:
                ax.axvline(float(place(view.at, view.scale)), color="0.5", ls=":", lw=1)
            top += height + BELOW + ABOVE
        if picture.key.scale:
            bar = axes(LEFT + width + 25, top - height - BELOW - ABOVE, 20, height)
            bar.imshow(
                [[to_rgb(colour)] for colour in picture.key.scale], origin="lower", aspect="auto", extent=(0, 1, 0, 1)
            )
            shares, numbers = zip(*picture.key.numbers, strict=True)
            bar.set(xticks=[], yticks=shares, yticklabels=numbers)
            bar.yaxis.tick_right()
        if moving:
            third = (width - LEFT) // 3
            for left, across, up, wider in ((LEFT, "xi", "dxi", 1), (2 * LEFT + third, "time", "xi", 2)):
                ax = axes(left, top, wider * third, MOTION_ROWS)
                for x, y, colour in zip(*(page.motion.data[n] for n in (across, up, "colour")), strict=True):
                    ax.plot(x, y, color=colour, lw=1.2)
                names = {"xi": "ξ", "dxi": "ξ′", "time": "τ/2π"}
                ax.set(xlabel=names[across], ylabel=names[up], title=f"{symbol(view.x, False)} = {view.at:.10g}")
        if key:
            fig.legend(handles=key, loc="lower center", ncols=columns, frameon=False)
        with tempfile.TemporaryDirectory() as folder:
            return save(fig, Path(folder) / f"view.{kind}", DPI).read_bytes()


def _key(picture: Picture, page: Page, moving: bool) -> list[Artist]:
    """Return the legend entries of all colours, ticks and curves of a figure. `moving`: with the curves of a motion."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    key: list[Artist] = [Patch(fc=colour, ec="0.5", label=name) for colour, name in picture.key.swatches]
    key += [Line2D([], [], color=ODD, marker="|", ls="", label=words) for words in picture.odd]
    for source, sign in ((page.lines, {}), (page.marks, {"marker": "o", "mfc": "w", "ls": ""})):
        kinds = dict.fromkeys(source.data["kind"])
        key += [Line2D([], [], **{"color": LOOKS[k][0], "ls": LOOKS[k][2], "label": k} | sign) for k in kinds]
    return key + [Line2D([], [], color=colour, label=name) for colour, name in CURVES if moving]


def _show(ax: Axes, view: View, picture: Picture, image: np.ndarray) -> None:
    """Draw an image in the window of the view."""
    from matplotlib.colors import LogNorm

    pixels = np.ascontiguousarray(picture.palette[image]).view(np.uint8).reshape(*image.shape, 4)
    extent = picture.x, picture.x + picture.dw, picture.y, picture.y + picture.dh
    ax.imshow(pixels, origin="lower", extent=extent, aspect="auto", interpolation="none")
    ax.set(xlabel=symbol(view.x), ylabel=symbol(view.y if view.mode == MAP else view.quantity))
    for axis, scale in ((ax.xaxis, view.scale), (ax.yaxis, view.y_scale if view.mode == MAP else LINEAR)):
        low, high = axis.get_view_interval()
        if scale == LOG and len(numbers := round_numbers(LogNorm(10**low, 10**high))) > 1:
            axis.set_ticks([low + share * (high - low) for share, _ in numbers], [text for _, text in numbers])
            axis.set_view_interval(low, high, ignore=True)
    for words, columns in picture.odd.items():
        at = picture.x + (np.array(columns) + 0.5) * picture.dw / image.shape[1]
        ax.plot(at, np.full(len(at), 1.0), "|", color=ODD, ms=8, transform=ax.get_xaxis_transform(), label=words)


def _lay_over(ax: Axes, page: Page) -> None:
    """Draw the exact orbits, curves and bifurcations of the page."""
    window = ax.axis()
    names = "x", "y", "colour", "width", "dash"
    for x, y, colour, width, dashes in zip(*(page.lines.data[name] for name in names), strict=True):
        ax.plot(x, y, color=colour, lw=0.75 * width, ls=dashes)
    marks = page.marks.data
    ax.scatter(marks["x"], marks["y"], s=30, c="white", edgecolors=marks["colour"], lw=1.2, zorder=3)
    ax.axis(window)


def result_file(view: View, results: Results) -> bytes:
    """Return the file of `vibrodrive sweep` for the exported configuration. Raises ValueError if it is too large."""
    plan, text = view.plan(), view.toml()
    if (size := file_bytes(plan)) > LARGEST_FILE:
        sizes = f"the file takes {human(size)}, and {human(LARGEST_FILE)} are allowed"
        raise ValueError(bad("periods", view.periods, f"smaller; {sizes} (use `vibrodrive sweep`)"))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "view.h5"
        writer = open_writer(path, plan, Origin(text, title=config.parse(text).title))
        for k, (start, stop) in enumerate(plan.blocks()):
            writer.write(results.block(k, start, stop))
        writer.close()
        return path.read_bytes()


def python(view: View) -> str:
    """Return a Python program that computes the sweep of this view, with the same bits, and draws its figure."""
    settings = config.parse(view.toml())
    scene, imports = settings.physical, ["import numpy as np"]
    lines = [] if scene is None else [f"scene = vd.{scene!r}"]
    if {*settings.arguments} & {*SCENE}:  # `vibrodrive sweep` accepts axes in SI units, `vd.sweep` does not
        imports = ["import subprocess", "import sys", "from pathlib import Path"]
        lines += [f'Path("view.toml").write_text("""{view.toml()}""")']
        lines += ['subprocess.run([sys.executable, "-m", "vibrodrive", "sweep", "view.toml"], check=True)']
        lines += ['results = vd.load("view.h5")']
    else:
        lines += ["results = vd.sweep(", *_arguments(view, settings), ")"]
    shown = view.shade if view.mode == MAP else view.quantity
    limits = f", limits={view.limits}" if view.limits else ""
    picture = file_name(view, "h5").removesuffix("h5") + "png"
    lines += [f"results.plot(quantity={shown!r}{limits}).savefig({picture!r})"]
    return "\n".join([*imports, "", "import vibrodrive as vd", "", *lines, ""])


def _arguments(view: View, settings: config.Config) -> Iterator[str]:
    """Yield the lines of the arguments of `sweep`."""
    columns, rows = view.grid
    axes = {view.x: (view.low, view.high, columns, view.scale)}
    if view.mode == MAP:
        axes[view.y] = view.y_low, view.y_high, rows, view.y_scale
    for name, value in settings.arguments.items():
        if name in axes:
            low, high, num, scale = axes[name]
            text = f"np.{'geomspace' if scale == LOG else 'linspace'}({low!r}, {high!r}, {num})"
        elif settings.physical is not None and name in ("A", "B"):
            text = f"scene.{name}"
        else:
            text = repr(value.tolist() if hasattr(value, "tolist") else value)
        yield f"    {name}={text},"


def motion_table(trajectory: Trajectory) -> str:
    """Return a motion as CSV: tau, xi, dxi and state at POINTS instants in each period."""
    sample = trajectory.sample(POINTS)
    columns = (array.tolist() for array in (sample.tau, sample.xi, sample.dxi, sample.state))
    rows = (f"{tau!r},{xi!r},{dxi!r},{State(state).name}" for tau, xi, dxi, state in zip(*columns, strict=True))
    return "\n".join(["tau,xi,dxi,state", *rows, ""])
