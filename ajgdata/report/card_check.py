"""The check of a sound card -> a picture and a page of one file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, encode, new_figure, plain_ticks, styled
from ajgdata.report.format import Caption, Source
from ajgdata.report.render import Picture, data_uri, render

TICKS_HZ = (30, 100, 300, 1_000, 3_000, 10_000)
#: More points of a waveform than this are drawn as the range of each stretch.
STRETCHES = 1_200


def card_page(
    check: Mapping[str, Any], take: NDArray[Any], delays: NDArray[Any], source: Source
) -> str:
    """Return the page of a check (acquire.card_check.CardCheck.summary) as HTML text.

    `take` (n,) is what was heard of a sweep, `delays` (m,) are those of one pulse a second.
    """
    figure = card_figure(check, take, delays, source)
    worst = check["verdict"][0]
    alt = f"Waveform, levels by third octave, distortion and delays of a card. {worst['said']}."
    shown = Picture("check", Caption("", alt), data_uri(encode(figure, "svg")), {})
    return render("device_check.html.j2", {"check": shown}, check=check, source=source)


@styled
def card_figure(
    check: Mapping[str, Any], take: NDArray[Any], delays: NDArray[Any], source: Source
) -> Figure:
    """Draw one take, its levels above the noise, its harmonics, and the delays of pulses."""
    title = f"{check['device']['device']} · {_FIRST[check['verdict'][0]['level']]}"
    topics = ", ".join(one["topic"] for one in check["verdict"] if one["level"] != "good")
    subtitle = f"to change: {topics}" if topics else "nothing to change"
    figure = new_figure((WIDTH_IN, 5.6), title, subtitle, [source])
    axes = figure.subplots(2, 2)
    _waveform(axes[0, 0], take, check["sample_rate_hz"], check["peak_dbfs"])
    _levels(axes[0, 1], check["bands"], check["hum"])
    _harmonics(axes[1, 0], check["bands"])
    _delays(axes[1, 1], check, delays)
    return figure


_FIRST = {"good": "ready", "change": "usable, better changed", "bad": "not usable yet"}


def _waveform(axes: Axes, take: NDArray[Any], rate_hz: int, peak_dbfs: float) -> None:
    """Range of the take over time, between the limits of the converter."""
    step = max(1, len(take) // STRETCHES)
    parts = take[: len(take) // step * step].reshape(-1, step)
    time = np.arange(len(parts)) * step / rate_hz
    axes.fill_between(time, parts.min(axis=1), parts.max(axis=1), color=COLOURS[0], lw=0.4)
    for limit in (-1, 1):
        axes.axhline(limit, color=COLOURS[1], lw=1)
    axes.set(xlabel="time (s)", ylabel="of full scale", ylim=(-1.12, 1.12), xlim=(0, time[-1]))
    axes.set_title(f"one take: peak {peak_dbfs:.1f} dBFS", loc="left")


def _levels(axes: Axes, bands: list[dict[str, Any]], hums: list[dict[str, Any]]) -> None:
    """Sweep and noise by third octave; what lies between them is what can be measured."""
    hz = [band["centre_hz"] for band in bands]
    level, noise = ([band[key] for band in bands] for key in ("level_dbfs", "noise_dbfs"))
    axes.fill_between(hz, noise, level, color=COLOURS[4], alpha=0.25, lw=0)
    axes.plot(hz, level, color=COLOURS[0], label="sweep")
    axes.plot(hz, noise, color=GREY, label="noise")
    strongest = max(hums, key=lambda one: one["prominence_db"])
    if strongest["prominence_db"] > 10:
        place = strongest["mains_hz"], strongest["level_dbfs"]
        axes.plot(*place, "v", color=COLOURS[1], label=f"hum, {strongest['mains_hz']} Hz")
    median = float(np.median([band["snr_db"] for band in bands]))
    _over_frequency(axes, "dBFS")
    axes.set_title(f"{median:.0f} dB above the noise (median)", loc="left")
    axes.set(ylim=(min(noise) - 5, max(*level, -20) + 25))
    axes.legend(loc="upper left", ncols=3, columnspacing=1)


def _harmonics(axes: Axes, bands: list[dict[str, Any]]) -> None:
    """Harmonics in percent of the fundamental, where they stand out of the noise."""
    found = [(b["centre_hz"], 100 * b["distortion"]) for b in bands if b["distortion"] is not None]
    if found:
        axes.plot(*zip(*found, strict=True), "o-", color=COLOURS[0], ms=3)
        worst = max(found, key=lambda one: one[1])
        said = f"harmonics: at most {worst[1]:.2g} %, at {worst[0]:.0f} Hz"
    else:
        said = "harmonics: none above the noise"
    axes.set(ylim=(0.01, 30), yscale="log")
    plain_ticks(axes.yaxis, (0.01, 0.1, 1, 10))
    _over_frequency(axes, "% of the fundamental")
    axes.set_title(said, loc="left")


def _over_frequency(axes: Axes, label: str) -> None:
    axes.set(xscale="log", xlim=(25, 18_000), xlabel="frequency (Hz)", ylabel=label)
    plain_ticks(axes.xaxis, TICKS_HZ)


def _delays(axes: Axes, check: Mapping[str, Any], delays: NDArray[Any]) -> None:
    """Delay of each pulse against the first: flat for one clock and no frame lost."""
    latency = check["latency_samples"]
    axes.plot(np.arange(len(delays)), delays, ".-", color=COLOURS[0], lw=1)
    reach = max(1.0, 1.1 * float(np.nanmax(np.abs(delays), initial=0.0)))
    axes.set(xlabel="time (s)", ylabel="delay of pulses (samples)", ylim=(-reach, reach))
    counted = check["lost_frames"] is not None
    lost = f", {check['lost_frames']} frames lost" if counted else ""
    axes.set_title(f"latency {latency[-1]} ± {max(latency) - min(latency)}{lost}", loc="left")
