# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The verdict: an example for each rule of its definition, and a second implementation."""

import math
import statistics
from collections.abc import Callable, Sequence

import numpy as np
import pytest
import scipy.stats
from synthetic_gait import events_of, ignores, locks, long_range, noisy_walk, regular_walk, white

from gait_entrainment.conventions import Side
from gait_entrainment.gait import Analysis, Reason, Verdict, VerdictSettings, analyze
from gait_entrainment.settings import settings_of

MS = 1_000_000
T = 2000 * MS  # unperturbed stride period
P = 1950 * MS  # pulse period, 50 ms below
BASELINE = 10


def experiment(
    perturbed: Sequence[int], pulses: int, period: int = P, washout: int = 3
) -> Analysis:
    """Analyze a walk with given stride periods under pulses; pulse 1 at phase 0.5 of stride 11."""
    walk = regular_walk([T] * BASELINE + list(perturbed) + [T] * washout)
    onsets = [BASELINE * T + T // 2 + n * period for n in range(pulses)]
    return analyze(walk, onsets, Side.RIGHT)


def verdicts(analysis: Analysis) -> list[Verdict]:
    return [e.verdict for e in analysis.entrainments]


def test_locked_walker_is_entrained_after_a_window_and_five_strides() -> None:
    analysis = experiment([P] * 40, 40)
    assert verdicts(analysis) == [Verdict.UNDECIDED] * 23 + [Verdict.ENTRAINED] * 17
    last = analysis.entrainments[-1]
    assert (last.stride, last.since_stride, last.entrained_since_stride) == (50, 34, 11)
    assert (last.unperturbed_period, last.unperturbed_period_error) == (2.0, 0.0)
    assert (last.pulse_period, last.mean_period) == (1.95, 1.95)
    assert abs(last.drift) < 1e-12
    assert last.phase_locking_value == pytest.approx(1.0)


def test_indifferent_walker_drifts_by_the_offset() -> None:
    analysis = experiment([T] * 30, 30)
    last = analysis.entrainments[-1]
    assert verdicts(analysis)[:19] == [Verdict.UNDECIDED] * 19  # 19 pulses, one a stride
    assert set(verdicts(analysis)[19:]) == {Verdict.DRIFTING}
    # 50 ms a pulse, and 2 / 1.95 pulses a stride.
    assert last.drift == pytest.approx(-0.05 * 2 / 1.95, rel=1e-9)
    assert last.drift_interval < 1e-9
    assert last.mean_period == 2.0
    assert last.entrained_since_stride is None


def test_walker_that_gives_up_is_lost() -> None:
    analysis = experiment([P] * 30 + [T] * 30, 60)
    assert analysis.entrainments[-1].verdict == Verdict.LOST
    sequence = list(dict.fromkeys(verdicts(analysis)))
    assert sequence == [Verdict.UNDECIDED, Verdict.ENTRAINED, Verdict.LOST]


def test_washout_does_not_change_the_verdict() -> None:
    short, long = (experiment([P] * 40, 40, washout=w) for w in (1, 60))
    # Compared as text, which is exact, because NaN does not equal itself.
    assert repr(short.entrainments) == repr(long.entrainments)
    assert long.entrainments[-1].stride == BASELINE + 40
    assert len(long.strides) == BASELINE + 40 + 60


@pytest.mark.parametrize("offset", [1, -1])
def test_offset_below_two_milliseconds_is_untestable(offset: int) -> None:
    below = experiment([T] * 30, 30, T + offset * (2 * MS - 1))
    assert verdicts(below) == [Verdict.UNDECIDED] + [Verdict.UNTESTABLE] * (
        len(verdicts(below)) - 1
    )
    above = experiment([T] * 30, 30, T + offset * (2 * MS + 1))
    assert above.entrainments[-1].verdict == Verdict.DRIFTING


def test_offset_below_two_standard_errors_is_untestable() -> None:
    # Baseline of 1.9, 2.0 and 2.1 s: mean 2.0 s, standard error 0.1 / sqrt(3) = 57.7 ms.
    baseline = [1900 * MS, 2000 * MS, 2100 * MS]
    for offset, expected in ((115, Verdict.UNTESTABLE), (116, Verdict.ENTRAINED)):
        period = T - offset * MS
        walk = regular_walk(baseline + [period] * 32)
        onsets = [3 * T + T // 2 + n * period for n in range(30)]
        last = analyze(walk, onsets, Side.RIGHT).entrainments[-1]
        assert last.unperturbed_period == 2.0
        assert last.unperturbed_period_error == pytest.approx(0.1 / math.sqrt(3))
        assert last.verdict == expected


@pytest.mark.parametrize("baseline", [0, 1])
def test_unknown_unperturbed_period_is_untestable(baseline: int) -> None:
    onsets = [baseline * T + T // 2 + n * P for n in range(30)]
    analysis = analyze(regular_walk([T] * baseline + [P] * 32), onsets, Side.RIGHT)
    assert analysis.entrainments[-1].verdict == Verdict.UNTESTABLE
    assert analysis.entrainments[-1].reason == Reason.BASELINE_UNKNOWN
    assert math.isnan(analysis.entrainments[-1].unperturbed_period_error)


def with_lags(
    lags: Sequence[int], period: int, stride: int, rule: VerdictSettings | None = None
) -> Analysis:
    """Analyze strides of one period, with toe-offs placed so that pulse n has lag n [ns]."""
    strikes = [k * T for k in range(BASELINE)]
    strikes += [BASELINE * T + k * stride for k in range(len(lags) + 2)]
    onsets = [BASELINE * T + 1500 * MS + n * period for n in range(len(lags))]
    toe_offs = [k * T + 1500 * MS for k in range(BASELINE)]
    toe_offs += [onset - lag for onset, lag in zip(onsets, lags, strict=True)]
    toe_offs.append(strikes[-2] + 1500 * MS)
    return analyze(events_of(strikes, toe_offs), onsets, Side.RIGHT, rule)


def test_scattered_lag_is_neither_entrained_nor_drifting() -> None:
    # A lag of +/- A in turn has the spread of a drift of A / 5.77; the margin is 17.5 ms.
    calm = with_lags([100 * MS * (-1) ** n for n in range(30)], P, P)
    wild = with_lags([300 * MS * (-1) ** n for n in range(30)], P, P)
    assert calm.entrainments[-1].verdict == Verdict.ENTRAINED
    assert set(verdicts(wild)) == {Verdict.UNDECIDED}


def test_steady_lag_without_the_pulse_period_is_not_entrained() -> None:
    # Toe-offs keep the pulses' 1.98 s, heel strikes 2 s: drift 0, mean period off by all of D.
    analysis = with_lags([0] * 22, 1980 * MS, T)
    last = analysis.entrainments[-1]
    assert abs(last.drift) + last.drift_interval < 1e-12
    assert last.mean_period == 2.0
    assert set(verdicts(analysis)) == {Verdict.UNDECIDED}


def creep(rate: Callable[[int], float], pulses: int = 60) -> Analysis:
    """Analyze a lag that moves by ``rate`` [ms] from each pulse to the next."""
    lags = np.cumsum([rate(n) for n in range(pulses)])
    return with_lags([round(MS * lag) for lag in lags], P, P)


@pytest.mark.parametrize("growth", [1.0, 1.03, 1.1, 0.98])
def test_slow_passage_is_undecided_because_the_lag_creeps(growth: float) -> None:
    # Always slower than a quarter of the 50 ms: away from an unstable lock, or towards the ghost
    # of a lock that has just ceased to exist.
    analysis = creep(lambda n: 4 * growth ** (n - (50 if growth > 1 else 0)))
    assert set(verdicts(analysis)) == {Verdict.UNDECIDED}
    assert analysis.entrainments[-1].reason == Reason.CREEPING


def test_approach_that_comes_to_rest_is_entrained() -> None:
    analysis = creep(lambda n: 20 * 0.8**n)
    assert analysis.entrainments[-1].verdict == Verdict.ENTRAINED


def test_every_inconclusive_verdict_gives_a_reason() -> None:
    few = experiment([P] * 18, 18).entrainments[-1]
    assert (few.verdict, few.reason) == (Verdict.UNDECIDED, Reason.FEW_PULSES)
    close = experiment([T] * 30, 30, T + MS).entrainments[-1]
    assert (close.verdict, close.reason) == (Verdict.UNTESTABLE, Reason.TOO_CLOSE)
    locked = experiment([P] * 40, 40).entrainments[-1]
    assert (locked.verdict, locked.reason) == (Verdict.ENTRAINED, Reason.NONE)


@pytest.mark.parametrize("period", [T // 2, T // 2 - 25 * MS, 2 * T, 3 * T // 2])
def test_pulses_at_a_rate_other_than_one_per_stride_are_untestable(period: int) -> None:
    last = experiment([T] * 60, 40, period).entrainments[-1]
    assert (last.verdict, last.reason) == (Verdict.UNTESTABLE, Reason.NOT_ONE_TO_ONE)


def test_failing_once_restarts_the_five_strides() -> None:
    lags = [0] * 50
    lags[22] = 400 * MS  # in the windows of pulses 23 to 42
    entrained, passing = (
        [e.stride for e in analysis.entrainments if e.verdict == Verdict.ENTRAINED]
        for analysis in (
            with_lags(lags, P, P),
            with_lags(lags, P, P, VerdictSettings(successive=1)),
        )
    )
    assert len(passing) > len(entrained) > 0
    assert entrained == [s for s in passing if all(s - i in passing for i in range(5))]


def test_entrained_since_the_lag_stays_within_ten_milliseconds() -> None:
    # A lag of 0.3 s that shrinks by 0.7 a stride: 0.3 * 0.7^9 = 12 ms, 0.3 * 0.7^10 = 8.5 ms.
    lags = [round(300 * MS * 0.7**n) for n in range(50)]
    assert lags[9] > 10 * MS > lags[10]
    last = with_lags(lags, P, P).entrainments[-1]
    assert last.verdict == Verdict.ENTRAINED
    assert last.entrained_since_stride == BASELINE + 1 + 10


def reference(analysis: Analysis, rule: VerdictSettings) -> list[tuple[Verdict, int | None]]:
    """Form the verdicts of docs/analysis.md from the published pulses, in another way."""
    answers: list[tuple[Verdict, int | None]] = []
    passed, entrained_before = 0, False
    first = min(p.stride for p in analysis.pulses)
    free = [s.period for s in analysis.strides if s.number < first]
    unperturbed, deviation = np.mean(free), np.std(free, ddof=1)
    for stride in sorted({p.stride for p in analysis.pulses}):
        every = [p for p in analysis.pulses if p.stride <= stride]
        latest = every[-rule.longest_window :]
        period = np.mean(np.diff([p.onset for p in latest])) * 1e-9 if len(latest) > 1 else np.nan
        d = abs(period - unperturbed)
        assert not d <= 2 * deviation / np.sqrt(len(free))
        size = 20 if len(latest) < 2 else int(np.clip(np.ceil(100 * deviation / d), 20, 40))
        window = every[-size:]
        if len(window) < min(size, 25):
            passed = 0
            answers.append((Verdict.UNDECIDED, None))
            continue
        n = len(window)
        x = np.array([p.stride + p.phase for p in window])
        u = np.array([p.unwrapped_lag for p in window])
        spread = np.std(u, ddof=1) / np.std(np.arange(n), ddof=1)
        scatter = np.sqrt(np.pi) / 2 * np.mean(np.abs(np.diff(u, 2)))
        creeps = spread > scatter and abs(u[-1] - u[n // 2]) > abs(u[n // 2] - u[0]) / 2
        line = scipy.stats.linregress(x, u)
        half = 1.96 * scatter * np.sqrt(6 / (5 * n))
        mean = np.mean(
            [s.period for s in analysis.strides if window[0].stride <= s.number <= stride]
        )
        stays = spread < min(0.35 * d, max(0.32 * scatter, 0.12 * d)) and not creeps
        passed = passed + 1 if stays and abs(mean - period) < 0.25 * d else 0
        since: int | None = None
        if passed >= rule.successive:
            verdict, entrained_before = Verdict.ENTRAINED, True
            tolerance = max(0.010, 2 * np.std(u, ddof=1))
            since = stride  # if even the latest pulse is an outlier
            for p in reversed(every):
                if abs(p.unwrapped_lag - np.median(u)) > tolerance:
                    break
                since = p.stride
        elif abs(line.slope) - half > 0.25 * d:
            verdict = Verdict.LOST if entrained_before else Verdict.DRIFTING
        else:
            verdict = Verdict.UNDECIDED
        answers.append((verdict, since))
    return answers


@pytest.mark.parametrize("variation", [0.004, 0.012, 0.02])
@pytest.mark.parametrize("response", [locks, ignores])
@pytest.mark.parametrize("noise", [white, long_range])
@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_a_second_implementation(response, noise, seed, variation) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(seed)
    events, onsets, _ = noisy_walk(rng, response, noise, variation, counts=(15, 60, 5))
    analysis = analyze(events, onsets, Side.RIGHT)
    published = [(e.verdict, e.entrained_since_stride) for e in analysis.entrainments]
    assert published == reference(analysis, VerdictSettings())
    assert statistics.mode(v for v, _ in published[45:]) == (
        Verdict.ENTRAINED if response is locks else Verdict.DRIFTING
    )


@pytest.mark.parametrize("name", settings_of(VerdictSettings))
def test_setting_out_of_range_is_refused_by_name(name: str) -> None:
    setting = settings_of(VerdictSettings)[name]
    assert setting.meaning
    assert setting.unit
    assert setting.least <= getattr(VerdictSettings, name) <= setting.most
    for bad in (setting.least - 1, setting.most + 1, math.nan):
        with pytest.raises(ValueError, match=f"^{name}: .*; allowed: "):
            VerdictSettings(**{name: bad})  # type: ignore[arg-type]


def test_fractional_count_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^window: 20.5; allowed: a whole number from 5 to 1000"):
        VerdictSettings(window=20.5)  # type: ignore[arg-type]
