"""Blocks of runs → HTML: fragments for any page, what they share, and a page of one or two runs."""

import base64
import json
import math
import re
from collections.abc import Callable
from importlib import resources
from pathlib import Path

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from simcore.config.units import UNITS_OF_SUFFIX, unit_suffix
from simcore.export.recording import Recording
from simcore.export.whole_file import write_whole
from simcore.pressure_scale import colour_stops, pressure_colours, scale_end
from simcore.viewer.pack import name_of, pack_body, pack_device, pack_run

SCRIPTS = ("vendor/three.min.js", "payload.js", "blend.js", "stage.js", "player.js")

TEMPLATES = Environment(
    loader=PackageLoader("simcore.viewer", "."), autoescape=True, undefined=StrictUndefined,
    trim_blocks=True, lstrip_blocks=True,
)

FORWARD = {"robotic_lift": "forward", "sling_lift": "to the feet"}


class Replays:
    """Replays of several runs on one page, with one pressure scale.

    A body and a device that several runs share are sent once. `fragment` may stand anywhere, and
    any number of times; `assets` stands once, after the last fragment.

    Parameters
    ----------
    scale : float
        End of the pressure scale [Pa].
    """

    def __init__(self, scale: float):
        self.scale = scale
        self._blocks: dict[str, bytes] = {}
        self._made: dict[str, bytes] = {}
        self._labels: dict[str, str] = {}
        self._kinds: set[str] = set()

    def add(
        self, run: str, recording: Recording, title: str | None = None, room: float = math.inf
    ) -> bool:
        """Take up a run under an id of letters, digits, `-` and `_`; by default titled by place.

        Return whether it was: not if `assets` would then take more than `room` bytes.
        """
        title = title or title_of(recording)
        design = recording.design
        block = self._once(design.body, lambda: pack_body(recording.body))
        body = name_of("body", block)
        blocks = {body: block}
        device = None
        if recording.net is None:
            block = self._once(design.device.rigid_part, lambda: pack_device(recording))
            device = name_of("device", block)
            blocks[device] = block
        labels = {"title": title, **_outcome(recording)}
        blocks[f"run-{run}"] = pack_run(recording, self.scale, labels, body, device)
        blocks = self._blocks | blocks
        if _size(blocks) > room:
            return False
        self._blocks = blocks
        self._labels[run] = title
        self._kinds.add(design.device.kind)
        return True

    def _once(self, design, make: Callable[[], bytes]) -> bytes:
        """Return the block of a design, made where it was not before: compressing takes longest."""
        key = design.model_dump_json()
        if key not in self._made:
            self._made[key] = make()
        return self._made[key]

    @property
    def runs(self) -> list[str]:
        """Ids of all runs taken up."""
        return list(self._labels)

    def fragment(self, shown: list[str], choose: bool = True, alone: bool = False) -> Markup:
        """Return a player.

        Parameters
        ----------
        shown : list of str
            Ids of one run, or of two to show side by side.
        choose : bool
            Let the reader choose among all runs added by now.
        alone : bool
            The page holds nothing else: keys and the mouse wheel are the player's.
        """
        ids = [f"run-{run}" for run in shown]
        choices = [(f"run-{run}", title) for run, title in self._labels.items()]
        ticks = [f"{tick:g}" for tick in np.linspace(0, 1e-3 * self.scale, 3)]
        stops = ", ".join(f"{colour} {100 * share:.3g}%" for share, colour in colour_stops())
        lifts = "robotic_lift" in self._kinds
        return Markup(TEMPLATES.get_template("fragment.html").render(
            shown=json.dumps(ids), alone=alone, choices=choices if choose else (), first=ids[0],
            second=ids[1] if len(ids) > 1 else "", options=_options,
            forward=" or ".join(FORWARD[kind] for kind in sorted(self._kinds)),
            see_through="the device" if lifts else "the sheet", ticks=ticks,
            gradient=f"linear-gradient(to right, {stops})",
        ))

    def assets(self) -> Markup:
        """Return the style, the data and the scripts of all fragments."""
        folder = resources.files("simcore.viewer")
        colours = pressure_colours(np.linspace(0, 1, 256), 1.0)
        table = np.column_stack([np.round(255 * colours), np.full(256, 255)]).astype(np.uint8)
        parts = [
            f"<style>{(folder / 'viewer.css').read_text(encoding='utf-8')}</style>",
            _data("colours", json.dumps(base64.b64encode(table.tobytes()).decode())),
            *(_data(name, base64.b64encode(block).decode())
              for name, block in self._blocks.items()),
            *(f"<script>{(folder / name).read_text(encoding='utf-8')}</script>"
              for name in SCRIPTS),
        ]
        return Markup("\n".join(parts))


def write_replay(recordings: list[Recording], out: Path, scale: float | None = None) -> None:
    """Write the replay of one run, or of two side by side, as one HTML file; whole or not at all.

    `scale` is the end of the pressure scale [Pa], by default one that covers both.
    """
    replays = Replays(scale or common_scale(recordings))
    shown = [f"{number}" for number in range(len(recordings))]
    for name, recording in zip(shown, recordings, strict=True):
        replays.add(name, recording)
    page = TEMPLATES.get_template("page.html").render(
        title=" | ".join(title_of(each) for each in recordings),
        fragment=replays.fragment(shown, choose=False, alone=True),
        assets=replays.assets(),
    )
    write_whole(out, page.encode())


def common_scale(recordings: list[Recording]) -> float:
    """Return a round pressure that covers those that held, or all if none did [Pa]."""
    held = [each for each in recordings if each.frames["fell"].item() < 0.5]
    return scale_end(max(float(each.pressure_peak.max()) for each in held or recordings))


def title_of(recording: Recording) -> str:
    """Return where a run lies in its study, in words."""
    if not recording.place:
        return recording.name
    return ", ".join(_words(name, value) for name, value in recording.place.items())


def _words(name: str, value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    ending = unit_suffix(name)
    words = name.removesuffix(ending).replace("_", " ")
    unit = re.sub(r" (\w+?)-1", r"/\1", UNITS_OF_SUFFIX.get(ending, "")).replace(" m-2", "/m²")
    number = f"{value:,.6g}".replace("-", "−")
    return f"{words} {number}°" if unit == "degree" else f"{words} {number} {unit}".rstrip()


def _outcome(recording: Recording) -> dict[str, str]:
    status = recording.frames["status"].item()
    fall = recording.frames["fall_time"].item()
    if status != "ok":
        return {"verdict": "failed", "outcome": f"! failed: {status.replace('_', ' ')}"}
    if recording.frames["fell"].item() > 0.5:
        when = f"at {fall:.1f} s" if fall >= 0 else f"{-fall:.1f} s before the start"
        return {"verdict": "fell", "outcome": f"✕ fell {when}"}
    return {"verdict": "held", "outcome": "✓ held"}


def _options(choices: list[tuple[str, str]], chosen: str) -> Markup:
    return Markup("").join(
        Markup('<option value="{}"{}>{}</option>').format(
            value, Markup(" selected") if value == chosen else "", title
        )
        for value, title in choices
    )


def _size(blocks: dict[str, bytes]) -> int:
    """Return how many bytes `Replays.assets` takes at the most: data as base64, style, scripts."""
    folder = resources.files("simcore.viewer")
    texts = sum(len((folder / name).read_bytes()) for name in ("viewer.css", *SCRIPTS))
    colours = 4 * 4 * 256 // 3 + 100
    tags = 20 * (1 + len(SCRIPTS))
    return texts + colours + tags + sum(100 + 4 * math.ceil(len(each) / 3)
                                        for each in blocks.values())


def _data(name: str, text: str) -> str:
    return f'<script type="text/plain" id="replay-{name}">{text}</script>'
