"""Files are replaced at once or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from bemkit.files import OutputFileError, check_target, replacing


def yes(path: Path) -> bool:
    return True


def no(path: Path) -> bool:
    return False


def test_a_finished_file_replaces_the_old_one(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old", "utf-8")
    with replacing(target) as temporary:
        assert temporary.parent == tmp_path
        temporary.write_text("new", "utf-8")
        assert target.read_text("utf-8") == "old"
    assert target.read_text("utf-8") == "new"
    assert os.listdir(tmp_path) == ["a.txt"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, MemoryError])
def test_whatever_is_raised_leaves_the_old_file_and_no_rest(tmp_path: Path, error: type[BaseException]) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old", "utf-8")

    def write_half() -> None:
        with replacing(target) as temporary:
            temporary.write_text("half", "utf-8")
            raise error

    with pytest.raises(error):
        write_half()
    assert target.read_text("utf-8") == "old"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_refusals_of_the_system_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(OutputFileError, match=r"cannot be written .*choose another place"), replacing(tmp_path / "a"):
        raise OSError(28, "No space left on device")


def test_targets_are_checked_before_any_work(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_text("mine", "utf-8")
    assert check_target(file, "result", yes) == file.resolve()
    assert check_target(tmp_path / "new", "result", no) == (tmp_path / "new").resolve()
    with pytest.raises(OutputFileError, match="exists and is not a result: choose another name"):
        check_target(file, "result", no)
    with pytest.raises(OutputFileError, match="does not exist: create it first"):
        check_target(tmp_path / "no" / "a", "result", yes)
    with pytest.raises(OutputFileError, match="exists and is not a file"):
        check_target(tmp_path, "result", yes)
    with pytest.raises(OutputFileError, match="not a usable file name"):
        check_target(Path("a\0b"), "result", yes)


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_folders_without_permission_are_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(OutputFileError, match="no permission"):
            check_target(tmp_path / "a", "result", yes)
    finally:
        tmp_path.chmod(0o700)


def test_a_link_is_followed_not_replaced(tmp_path: Path) -> None:
    target, link = tmp_path / "a.txt", tmp_path / "link"
    target.write_text("old", "utf-8")
    link.symlink_to(target)
    with replacing(check_target(link, "text", yes)) as temporary:
        temporary.write_text("new", "utf-8")
    assert link.is_symlink()
    assert target.read_text("utf-8") == "new"
