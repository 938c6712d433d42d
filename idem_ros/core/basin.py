"""Whether a stage ended in a valley of q_tot, and whether it has left that of the guess."""

import numpy as np

from idem_ros.core import se3
from idem_ros.core.constraint import middle_and_arm, unit_motions
from idem_ros.core.contrast import contrasts, sums_at_each

SAMPLE = 64  # centres of each cloud, about
# How likely a solve succeeds: logistic in the logarithm of the mean contrast, its slope and where
# it is even; where the first stage ended, and where the last coarse one did.
FIRST, LAST = (2.13, 0.0615), (3.96, 0.0963)
LEAST = 0.01
FAR = 1.5  # of the first radius: guesses from which all succeed end nearer
POOR = 0.2  # nat: on average where surfaces coincide, scans of an object with their noise apart
FARTHEST, PROBE = 5.0, 0.5  # of the radius


def credibility(joint, T_target_source, model):
    """Return how likely a solve succeeds of which a coarse stage ended here, 0 to 1.

    In a valley every way out leads up: by how much q_mean rises a radius away, on average.
    """
    motions = _units(joint, T_target_source)
    pairs = joint.pairs_at(T_target_source)
    near = [np.flatnonzero(np.diff(side.first)) for side in (pairs.of_target, pairs.of_source)]
    mean = float(contrasts(joint, T_target_source, motions, near, SAMPLE).mean())
    slope, middle = model
    return 1.0 / (1.0 + (middle / max(mean, LEAST)) ** slope)


def has_strayed(joint, T_target_source, T_guess, widest):
    """Whether a solve may have left the basin of its guess.

    The clouds agree less here than at the guess, though no fewer met there; or they agree badly,
    far beyond the radius that the solve looked at first. Within a radius of the guess it is the
    guess that is inexact: no basin was left.

    Args:
        joint: the `JointEntropy` of the last stage.
        T_target_source: (4, 4) where it ended, between the clouds' origins.
        T_guess: (4, 4) likewise.
        widest: radius of the first stage.
    """
    way = _way(joint, T_target_source, T_guess)
    if way < joint.radius:
        return False
    (here, there), (near, far) = zip(
        *(sums_at_each(joint, T[None], _everywhere(joint)) for T in (T_target_source, T_guess)),
        strict=True,
    )
    if way > FAR * widest and here > POOR * near:
        return True
    return bool(far >= near > 0 and there * near < here * far)


def best_of(joint, transforms):
    """Return the index of the transform at which the clouds agree best.

    Of those at which at least half as many points meet as at any: a few agree anywhere.
    """
    looks = [sums_at_each(joint, T[None], _everywhere(joint)) for T in transforms]
    q, within = np.array(looks)[:, :, 0].T
    enough = 2.0 * within >= within.max()
    return int(np.argmin(np.where(enough, q / np.maximum(within, 1.0), np.inf)))


def gauge(joint, T_target_source, T_guess):
    """Return how far a guess was on the way from a minimum to the crown of maxima around it.

    0 at the minimum, 1 at the rim, more beyond. q_tot is probed along the one motion that leads
    through both poses, each half radius of the surfaces' motion, up to FARTHEST radii.

    Args:
        joint: a `JointEntropy` at a coarse radius.
        T_target_source: (4, 4) the minimum, between the clouds' origins.
        T_guess: (4, 4) likewise.
    """
    twist = se3.log(T_guess @ se3.inverse(T_target_source))
    way = _way(joint, T_target_source, T_guess) / joint.radius
    if way == 0.0:
        return 0.0
    places = np.arange(0.0, FARTHEST + PROBE, PROBE)
    step, transforms = se3.exp(PROBE / way * twist), [T_target_source]
    for _ in places[1:]:
        transforms.append(step @ transforms[-1])
    q, _ = sums_at_each(joint, np.array(transforms), _everywhere(joint), SAMPLE)
    return way / places[max(int(np.argmax(q)), 1)]


def _way(joint, T_target_source, T_guess):
    """Return how far the surfaces move from one pose to the other, in the clouds' unit."""
    twist = se3.log(T_guess @ se3.inverse(T_target_source))
    return float(np.linalg.norm(np.linalg.solve(_units(joint, T_target_source), twist)))


def _units(joint, T_target_source):
    middle, arm = middle_and_arm(joint, T_target_source)
    return unit_motions(middle, np.eye(3) / arm)


def _everywhere(joint):
    return [np.arange(len(cloud.order)) for cloud in (joint.target, joint.source)]
