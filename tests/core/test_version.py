"""Version of the code: read from git's own files, and from the header of a recording."""

import subprocess
from pathlib import Path

import pytest

from coneskin import __version__
from coneskin.core import version
from coneskin.core.version import _code_commit, code_versions, recorded_version


def commit_of(folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(version, "__file__", str(folder / "src" / "coneskin" / "core" / "version.py"))
    _code_commit.cache_clear()
    try:
        return _code_commit()
    finally:
        _code_commit.cache_clear()


def git(folder: Path, *words: str) -> str:
    identity = ("-c", "user.name=A", "-c", "user.email=a@example.com")
    done = subprocess.run(["git", *identity, "-C", str(folder), *words], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_the_commit_is_that_of_git_loose_packed_and_detached(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    git(tmp_path, "init", "-q")
    assert commit_of(tmp_path, monkeypatch) == ""
    git(tmp_path, "commit", "-q", "--allow-empty", "-m", "One")
    commit = git(tmp_path, "rev-parse", "HEAD")
    assert commit_of(tmp_path, monkeypatch) == commit
    git(tmp_path, "pack-refs", "--all")
    assert commit_of(tmp_path, monkeypatch) == commit
    git(tmp_path, "worktree", "add", "-q", str(tmp_path / "tree"), "-b", "other")
    assert commit_of(tmp_path / "tree", monkeypatch) == commit
    git(tmp_path, "checkout", "-q", "--detach")
    assert commit_of(tmp_path, monkeypatch) == commit


def test_code_that_was_installed_without_git_has_its_version_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert commit_of(tmp_path, monkeypatch) == ""
    assert recorded_version({"coneskin": __version__, "commit": "", "build": "pure"}) == f"{__version__} (pure)"


def test_a_header_says_who_recorded() -> None:
    assert recorded_version({"coneskin": "0.1.0", "commit": "984714cdeadbeef"}) == "0.1.0 (984714c)"
    assert recorded_version({"coneskin": "0.1.0", "commit": ""}) == "0.1.0"
    assert recorded_version({"coneskin": "0.1.0", "commit": "984714c", "build": "pure"}) == "0.1.0 (984714c, pure)"
    assert recorded_version(code_versions()).startswith(f"{__version__} (")
    assert recorded_version({"coneskin": 7}) == recorded_version({}) == ""
