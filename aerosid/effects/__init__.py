"""The catalogue of effects that a declared model may lack: one small file a family, each with equation and source."""

from aerosid.effects.kinds import (
    ActiveEffect,
    Effect,
    EffectParameter,
    InputEffect,
    NoiseEffect,
    OutputEffect,
    StateEffect,
    frozen,
)

__all__ = [
    "ActiveEffect",
    "Effect",
    "EffectParameter",
    "InputEffect",
    "NoiseEffect",
    "OutputEffect",
    "StateEffect",
    "frozen",
]
