"""Runs → a replay in three dimensions, in one HTML file that opens without a network.

    replays = Replays(scale_end(peak))
    replays.add("a", recording, "support angle 7°")
    html = replays.fragment(["a"]) + replays.assets()
"""

from simcore.viewer.page import Replays, write_replay

__all__ = ["Replays", "write_replay"]
