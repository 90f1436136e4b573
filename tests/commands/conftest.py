from pathlib import Path

import pytest

from .design_run import design


@pytest.fixture(scope="session")
def cylinder_design(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The design of a cylinder: to be copied, and not changed."""
    folder = tmp_path_factory.mktemp("cylinder") / "skin"
    assert design("--radius1-mm", "54", "--height-mm", "200", "-o", str(folder)) == 0
    return folder
