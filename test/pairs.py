"""Clouds and guesses as plain records, of which the pairing reads the headers only."""

from types import SimpleNamespace as Record

from poses import SECOND, header
from poses import transform as guess_message

LONG_AGO = 100 * SECOND
LATER = LONG_AGO + 20 * SECOND


def cloud(stamp, frame=''):
    return Record(header=header(stamp, frame))


def guess(stamp, frame='', child=''):
    """A guess whose x tells its stamp [ns]."""
    return guess_message(stamp, float(stamp), frame, child)


def x_of(pair):
    return pair.guess.T_target_source[0, 3]
