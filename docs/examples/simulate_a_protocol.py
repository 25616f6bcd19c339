# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Simulate a protocol and print how the phase lag settles: python simulate_a_protocol.py."""

from gait_entrainment.protocol import Protocol, PulsePlan
from gait_entrainment.simulation import simulate

protocol = Protocol(pulses=PulsePlan(count=60, period_offset=-0.07))
simulation = simulate(protocol)

print(f"stride period {simulation.measured_period:.4f} s")
print(f"pulse period  {simulation.pulse_period:.4f} s")
for pulse in simulation.analysis.pulses[9::10]:
    print(f"pulse {pulse.number:2}  phase {pulse.phase:.3f}  lag {1e3 * pulse.phase_lag:+.1f} ms")
print(f"verdict: {simulation.analysis.entrainments[-1].verdict.name.lower()}")
