"""The machine a benchmark ran on."""

import os
import pathlib
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

PACKAGES = (
    "numpy",
    "scipy",
    "jax",
    "jaxlib",
    "diffrax",
    "simbrake",
    "scikit-sundae",
    "casadi",
    "heyoka",
    "pydiffsol",
    "pathsim",
)


def machine() -> dict[str, Any]:
    """CPU, cores and versions."""
    cpu = platform.processor() or platform.machine()
    info = pathlib.Path("/proc/cpuinfo")
    if info.exists():
        cpu = next(
            (
                x.split(":")[1].strip()
                for x in info.read_text().splitlines()
                if x.startswith("model name")
            ),
            cpu,
        )
    versions = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "cpu": cpu,
        "cores": os.cpu_count(),
        "system": platform.system(),
        "load": load,
        "versions": versions,
    }


def measured_on(about: dict[str, Any], packages: tuple[str, ...]) -> str:
    """The machine in one sentence."""
    versions = ", ".join(f"{name} {about['versions'][name]}" for name in packages)
    return (
        f"Measured on {about['cpu']}, {about['cores']} cores (load "
        f"{about['load']:.1f}); {versions}."
    )
