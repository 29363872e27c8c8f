"""What is asked for of the real arm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from postproc.cli.options import EffectFiles, Flag, ModelFile

if TYPE_CHECKING:
    from postproc.settings import Settings


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RobotOptions:
    """The real arm.

    Attributes:
        model: TOML file of the real arm, or controller: joint compliances of Absolute Accuracy in the backup. Default:
            the shipped model of the arm, with elastic joints.
        robot: arm of the library, in place of the model's. Default: that of the controller's backup.
        model_of_another_arm: with --robot: the model was made for another arm, and is meant for this one all the same.
    """

    model: ModelFile = None
    robot: str | None = None
    model_of_another_arm: Flag = False
    effects: EffectFiles = ()

    def _stated(self) -> dict[str, Any]:
        """Return these options by the keys of ``postproc.toml``; None where one was not given."""
        return {"model": self.model and str(self.model), "robot": self.robot}

    def settings_at(self, place: Path, entry: str | None = None) -> Settings:
        """Return the settings of programs in a folder: its ``postproc.toml``, then these options and `entry`."""
        from postproc.settings_files import StatedSettings, settings_at, with_choices

        chosen = with_choices(settings_at(place), StatedSettings.model_construct(None, **self._stated()), Path())
        options = replace(chosen.options, entry=entry)
        return replace(chosen, effects=self.effects, another_arm=self.model_of_another_arm, options=options)
