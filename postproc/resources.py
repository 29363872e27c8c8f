"""Where the files that come with the package are: templates, samples, pages of the documentation."""

from __future__ import annotations

from pathlib import Path


def resource(*parts: str) -> Path:
    """Path of a file or folder that ships with the package, such as ``resource("templates", "module.j2")``.

    A wheel carries these folders inside the package. In a checkout (also when installed with ``pip install -e``, which
    leaves a stale copy in site-packages that must not be read) they stand beside it.
    """
    package = Path(__file__).resolve().parent
    packaged = package.joinpath(parts[0])
    root = package if packaged.is_dir() else package.parent
    return root.joinpath(*parts)
