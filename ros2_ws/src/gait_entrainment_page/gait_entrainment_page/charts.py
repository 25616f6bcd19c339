# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The charts of the page as ECharts options; each would reveal the condition to a blinded operator.

Colours are those of Okabe and Ito (2008), which colour-blind people can tell apart; lines also
differ in their dashes.
"""

import math
import statistics
from typing import Any

from gait_entrainment_page.view import View

BLUE, VERMILLION, GREEN = "#0072B2", "#D55E00", "#009E73"
BLACK, GREY = "#1A1A1A", "#5F6B76"
_FONT = 17  # [px], readable from two metres
_LARGEST = 1e9  # larger values lie outside the chart
_DARK_GREEN = "#00704F"  # of text on the shading

Options = dict[str, Any]
Points = list[list[float]]


def period_chart(view: View) -> Options:
    """Return stride period and pulse period over the strides."""
    strides: Points = [[n, period] for n, period in view.strides]
    series = [_line("stride period", strides, BLUE, symbol="circle", symbolSize=6)]
    if strides and view.state is not None:
        first, last = strides[0][0], strides[-1][0]
        for name, value, color, dash in (
            ("baseline", view.state.measured_period, GREY, "dotted"),
            ("pulse period", view.state.pulse_period, VERMILLION, "dashed"),
        ):
            if not math.isnan(value):
                level = [[first, value], [last, value]]
                series.append(_line(name, level, color, dash))
    values = [y for line in series for _, y in line["data"]]
    return _chart("stride", "s", series, _range(values, least=0.02))


def lag_chart(view: View) -> Options:
    """Return the phase lag over the strides, double stance shaded, in ms and % of the stride."""
    lags: Points = [[n, 1e3 * lag] for n, lag in view.lags]
    name = f"phase lag: pulse onset minus {view.lag_refers_to}"
    series = [_line(name, lags, BLACK, symbol="circle", symbolSize=7)]
    series[0]["lineStyle"]["width"] = 1
    stance = 1e3 * statistics.median(view.stances) if view.stances else math.nan
    values = [lag for _, lag in lags] + [0.0]
    if not math.isnan(stance):
        values.append(-stance)
        series[0]["markArea"] = _shade({"yAxis": -stance}, {"yAxis": 0}, "insideBottomLeft")
    low, high = _range(values, least=100.0)
    chart = _chart("stride", "ms", series, (low, high))
    if 1 / _LARGEST < view.period < math.inf:
        per_cent = 0.1 / view.period
        right = _axis("%", low * per_cent, high * per_cent)
        chart["grid"]["right"] = 62
        chart["yAxis"].append(right | {"splitLine": {"show": False}})
        # ECharts shows an axis only if a series uses it.
        chart["series"].append({"type": "line", "yAxisIndex": 1, "data": [], "name": ""})
    return chart


def torque_chart(view: View) -> Options:
    """Return the torque of the last stride, commanded and measured."""
    commanded: Points = [[at, c] for at, c, _ in view.torque]
    measured: Points = [[at, m] for at, _, m in view.torque if not math.isnan(m)]
    series = [_line("commanded", commanded, BLACK, "dashed", step="end")]
    if measured or not commanded:
        name = "computed (simulated robot)" if view.simulated else "measured"
        # A computed torque is reported only when it changes.
        series.append(_line(name, measured, BLUE, step="end" if view.simulated else False))
        series[-1]["lineStyle"]["width"] = 3
    else:
        series[0]["name"] = "commanded (not measured by this robot)"
    if view.torque and view.toe_off > 0 and view.double_stance > 0:
        begin, end = view.toe_off - view.double_stance, view.toe_off
        series[0]["markArea"] = _shade({"xAxis": begin}, {"xAxis": end}, "top")
    values = [y for line in series for _, y in line["data"]] + [0.0]
    chart = _chart("s from heel strike", "N m", series, _range(values, least=2.0))
    chart["xAxis"] |= {"min": 0, "max": round(view.torque[-1][0], 3) if view.torque else 1}
    return chart


def _line(name: str, data: Points, color: str, dash: str = "solid", **more: Any) -> Options:
    style = {"color": color, "width": 2.5, "type": dash}
    series = {"type": "line", "name": name, "data": data, "symbol": "none", "lineStyle": style}
    return series | {"itemStyle": {"color": color}, "animation": False} | more


def _shade(begin: Options, end: Options, position: str) -> Options:
    label = {"show": True, "position": position, "color": _DARK_GREEN, "fontSize": _FONT}
    area = [{"name": "double stance", **begin}, end]
    style = {"color": GREEN, "opacity": 0.18}
    return {"silent": True, "itemStyle": style, "label": label, "data": [area]}


def _range(values: list[float], least: float) -> tuple[float, float]:
    """Return a range that contains the values and is not shorter than ``least``."""
    values = [value for value in values if abs(value) < _LARGEST]
    if not values:
        return 0.0, 1.0
    low, high = min(values), max(values)
    margin = max((least - (high - low)) / 2, 0.0)
    return low - margin, high + margin


def _axis(name: str, low: float, high: float) -> Options:
    """Return a vertical axis with ticks at round numbers, however odd its range."""
    text = {"fontSize": _FONT, "color": BLACK}
    step = 10 ** math.floor(math.log10(max(high - low, 1e-9)))
    step = next(s for s in (step / 5, step / 2, step, 2 * step) if (high - low) / s <= 6)
    return {
        "type": "value",
        "name": name,
        "nameTextStyle": text,
        "min": round(step * math.floor(low / step), 9),
        "max": round(step * math.ceil(high / step), 9),
        "interval": step,
        "axisLabel": text,
        "splitLine": {"lineStyle": {"color": "#E3E7EB"}},
    }


def _chart(across: str, up: str, series: list[Options], within: tuple[float, float]) -> Options:
    text = {"fontSize": _FONT, "color": BLACK}
    return {
        "animation": False,
        "grid": {"left": 70, "right": 24, "top": 58, "bottom": 52},
        "legend": {
            "top": 0,
            "textStyle": text,
            "itemWidth": 34,
            "itemStyle": {"opacity": 0},  # lines alone
            "data": [line["name"] for line in series],
        },
        "xAxis": {
            "type": "value",
            "name": across,
            "nameLocation": "middle",
            "nameGap": 30,
            "nameTextStyle": text,
            "axisLabel": text | {"showMaxLabel": False},
            "minInterval": 1 if across == "stride" else 0,
            "min": "dataMin" if across == "stride" else 0,
            "max": "dataMax" if across == "stride" else 1,
            "splitLine": {"show": False},
        },
        "yAxis": [_axis(up, *within)],
        "series": series,
    }
