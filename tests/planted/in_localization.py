"""Faults in filters, particles and wheels."""

from __future__ import annotations

from tests.planted.fault import Fault

FAULTS = (
    Fault(
        "log-weights-not-renormalized",
        "states/localization/matching/amcl.py",
        "        self._logs -= self._logs.max()\n",
        "",
        (
            "tests/states/localization/matching/test_amcl.py::"
            "test_weights_stay_representable_however_many_scans_are_taken"
        ),
    ),
    Fault(
        "weights-underflow",
        "states/localization/matching/particles.py",
        "weights = np.exp(logs - logs.max())",
        "weights = np.exp(logs)",
        (
            "tests/states/localization/matching/test_particles.py::"
            "test_weights_of_any_logarithms_add_up_to_one"
        ),
    ),
    Fault(
        "innovation-of-a-yaw-not-wrapped",
        "states/localization/filter/filter_kernels.py",
        "            missed[k] = _wrapped(missed[k])\n",
        "            missed[k] = 1.0 * missed[k]\n",
        (
            "tests/states/localization/filter/test_filter_kernels.py::"
            "test_whole_turns_of_a_measured_yaw_do_not_count"
        ),
    ),
    Fault(
        "jacobian-by-the-turn-rate",
        "states/localization/filter/filter_kernels.py",
        "transition[0, 5] = c * ahead_slope - s * aside_slope",
        "transition[0, 5] = c * ahead_slope + s * aside_slope",
        (
            "tests/states/localization/filter/test_filter_kernels.py::"
            "test_jacobians_are_the_numerical_derivatives"
        ),
    ),
    Fault(
        "jacobian-by-the-pitch",
        "states/localization/filter/filter_kernels.py",
        "transition[2, 4] = -cp * moved_by[0]",
        "transition[2, 4] = cp * moved_by[0]",
        (
            "tests/states/localization/filter/test_filter_kernels.py::"
            "test_jacobians_are_the_numerical_derivatives"
        ),
    ),
    Fault(
        "noise-of-the-pose-alone",
        "states/localization/filter/filter_kernels.py",
        "weights[i] += weights[3 + i] * dt * dt / 12.0",
        "weights[i] += weights[3 + i] * dt * dt / 3.0",
        (
            "tests/states/localization/filter/test_filter_kernels.py::"
            "test_planar_noise_is_that_of_white_acceleration_and_of_slip"
        ),
    ),
    Fault(
        "noise-as-a-standard-deviation",
        "states/localization/filter/kalman.py",
        "np.diag(np.square(self._config.initial))",
        "np.diag(np.asarray(self._config.initial))",
        (
            "tests/states/localization/filter/test_kalman.py::"
            "test_before_a_measurement_the_covariance_is_that_of_the_initial_standard_deviations"
        ),
    ),
    Fault(
        "likelihood-by-the-variance",
        "states/localization/matching/particles.py",
        "-0.5 * (d / sigma) ** 2",
        "-0.5 * d**2 / sigma",
        (
            "tests/states/localization/matching/test_particles.py::"
            "test_weights_are_sums_of_the_logarithms_of_beams"
        ),
    ),
    Fault(
        "yaw-bins-truncated",
        "states/localization/matching/particles.py",
        "turn = math.floor(particles[i, 2] / BIN_RAD) % _YAW_BINS",
        "turn = int(particles[i, 2] / BIN_RAD) % _YAW_BINS",
        (
            "tests/states/localization/matching/test_particles.py::"
            "test_bins_that_touch_are_one_cluster_across_the_turn_too"
        ),
    ),
    Fault(
        "a-degree-of-freedom-too-many",
        "states/localization/matching/particles.py",
        "return (bins_ - 1) / (2.0 * error)",
        "return bins_ / (2.0 * error)",
        (
            "tests/states/localization/matching/test_particles.py::"
            "test_kld_counts_by_the_quantile_of_chi_squared"
        ),
    ),
    Fault(
        "covariance-across-pi",
        "states/localization/matching/particles.py",
        "off[2] = wrapped(particles[i, 2] - mean[2])",
        "off[2] = particles[i, 2] - mean[2]",
        (
            "tests/states/localization/matching/test_particles.py::"
            "test_mean_and_covariance_are_those_of_the_chosen"
        ),
    ),
    Fault(
        "particles-in-the-frame-of-the-table",
        "states/localization/matching/amcl.py",
        "np.mod(yaw + corner.yaw + math.pi, 2.0 * math.pi)",
        "np.mod(yaw + math.pi, 2.0 * math.pi)",
        (
            "tests/states/localization/matching/test_amcl.py::"
            "test_particles_are_spread_along_the_axes_of_the_map_however_its_corner_is_turned"
        ),
    ),
    Fault(
        "covariance-in-the-frame-of-the-table",
        "states/localization/matching/amcl.py",
        "            covariance = turn @ covariance @ turn.T\n        return",
        "            covariance = turn.T @ covariance @ turn\n        return",
        (
            "tests/states/localization/matching/test_amcl.py::"
            "test_particles_are_spread_along_the_axes_of_the_map_however_its_corner_is_turned"
        ),
    ),
    Fault(
        "wheels-between-the-longer-way",
        "states/localization/wheels/trail.py",
        "a[2] + share * wrapped(b[2] - a[2])",
        "a[2] + share * (b[2] - a[2])",
        (
            "tests/states/localization/wheels/test_trail.py::"
            "test_between_two_poses_it_turns_by_the_shorter_way"
        ),
    ),
    Fault(
        "bias-overshoots-after-a-pause",
        "states/localization/wheels/gyro.py",
        "(1.0 - math.exp(-elapsed / SETTLE))",
        "(elapsed / SETTLE)",
        (
            "tests/states/localization/wheels/test_trail.py::"
            "test_the_bias_approaches_the_reading_and_never_goes_beyond_it"
        ),
    ),
    Fault(
        "mean-rate-of-all-readings",
        "states/localization/wheels/gyro.py",
        "return total / count - self.bias",
        "return total / count + self.bias",
        (
            "tests/states/localization/wheels/test_trail.py::"
            "test_the_bias_of_the_gyroscope_is_learnt_while_the_wheels_stand"
        ),
    ),
    Fault(
        "turn-across-pi-contradicts",
        "states/localization/wheels/odometry_watch.py",
        "off = abs(wrapped(by_scans[2] - by_wheels[2]))",
        "off = abs(by_scans[2] - by_wheels[2])",
        (
            "tests/states/localization/wheels/test_trail.py::"
            "test_half_a_turn_between_two_scans_is_the_same_on_either_side_of_pi"
        ),
    ),
    Fault(
        "yaw-error-across-pi",
        "cobodeck/evaluate/localization.py",
        "abs(wrap(estimate.pose.yaw - true.yaw))",
        "abs(estimate.pose.yaw - true.yaw)",
        (
            "tests/cobodeck/evaluate/test_localization_watch.py::"
            "test_an_estimate_on_the_other_side_of_half_a_turn_is_a_little_off"
        ),
    ),
)
