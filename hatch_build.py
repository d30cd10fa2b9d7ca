"""Build hook: a wheel that carries compiled kernels, where AEROSID_WHEEL_KERNELS names their folder (make wheel)."""

from __future__ import annotations

import os
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CompiledKernels(BuildHookInterface):
    """Takes the kernels in beside their loader, and names the platform that they were compiled on in the tag."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Adds the folder to the wheel; a wheel without it stays one for every platform."""
        folder = os.environ.get("AEROSID_WHEEL_KERNELS")
        if not folder or version == "editable":
            return
        if not any(name.endswith(".nbc") for name in os.listdir(folder)):
            raise FileNotFoundError(f"{folder} holds no compiled kernels; run `make wheel`")
        build_data["force_include"][os.path.abspath(folder)] = "aerosid/compiled/kernels"
        build_data["pure_python"] = False
        build_data["infer_tag"] = True
