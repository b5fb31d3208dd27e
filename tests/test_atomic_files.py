"""Files are replaced at once or not at all."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import pytest

from bemkit import atomic_files
from bemkit.atomic_files import FileLock, HeldElsewhereError, OutputFileError, check_target, replacing, reserved


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
    assert check_target(file) == file.resolve()
    assert check_target(tmp_path / "new") == (tmp_path / "new").resolve()
    with pytest.raises(OutputFileError, match="does not exist: create it first"):
        check_target(tmp_path / "no" / "a")
    with pytest.raises(OutputFileError, match="exists and is not a file"):
        check_target(tmp_path)
    with pytest.raises(OutputFileError, match="not a usable file name"):
        check_target(Path("a\0b"))


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_folders_without_permission_are_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(OutputFileError, match="no permission"):
            check_target(tmp_path / "a")
    finally:
        tmp_path.chmod(0o700)


def test_a_link_is_followed_not_replaced(tmp_path: Path) -> None:
    target, link = tmp_path / "a.txt", tmp_path / "link"
    target.write_text("old", "utf-8")
    link.symlink_to(target)
    with replacing(check_target(link)) as temporary:
        temporary.write_text("new", "utf-8")
    assert link.is_symlink()
    assert target.read_text("utf-8") == "new"


def test_a_reserved_file_is_refused_to_others(tmp_path: Path) -> None:
    target, other = tmp_path / "a.h5", tmp_path / "b.h5"
    with reserved([target, other]):
        with pytest.raises(OutputFileError, match=r"a\.h5: another process will write this file: wait for it to end"):
            with reserved([target]):
                pass
        with replacing(target) as temporary:  # what its holder writes in the meantime
            temporary.write_text("row 1", "utf-8")
    with reserved([target]):
        pass
    assert os.listdir(tmp_path) == ["a.h5"]


def test_a_folder_that_takes_no_lock_file_is_named(tmp_path: Path) -> None:
    (tmp_path / ".a.h5.lock").mkdir()
    with (
        pytest.raises(OutputFileError, match=r"a\.h5: cannot be written \(Is a directory\)"),
        reserved([tmp_path / "a.h5"]),
    ):
        pass


def test_a_file_of_others_with_the_name_of_the_lock_stays(tmp_path: Path) -> None:
    mine = tmp_path / ".a.h5.lock"
    mine.write_text("mine", "utf-8")
    with reserved([tmp_path / "a.h5"]):
        pass
    assert mine.read_text("utf-8") == "mine"


def test_leftovers_of_the_dead_are_removed_and_files_of_the_living_stay(tmp_path: Path) -> None:
    dead, living, other = (tmp_path / f".a.h5.{k * 32}.tmp" for k in "012")
    other = tmp_path / f".b.h5.{'2' * 32}.tmp"
    for path in (dead, living, other):
        path.write_text("half", "utf-8")
    with contextlib.closing(FileLock(living)):
        with replacing(tmp_path / "a.h5") as temporary:
            temporary.write_text("whole", "utf-8")
        assert sorted(os.listdir(tmp_path)) == sorted([living.name, other.name, "a.h5"])
    with reserved([tmp_path / "a.h5"]):
        assert not living.exists()


def test_a_lock_on_a_removed_file_is_taken_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its holder removes the file after another process has opened it and before that locks it."""
    path = tmp_path / "lock"
    lock = atomic_files._lock

    def slowly(descriptor: int, waits: bool) -> bool:
        monkeypatch.undo()
        path.unlink()
        return lock(descriptor, waits)

    monkeypatch.setattr(atomic_files, "_lock", slowly)
    with contextlib.closing(FileLock(path)):
        assert path.exists()
        with pytest.raises(HeldElsewhereError, match="another process holds the lock"):
            FileLock(path)


def test_without_locks_nothing_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    perhaps_living = tmp_path / f".a.h5.{'0' * 32}.tmp"
    perhaps_living.write_text("half", "utf-8")
    monkeypatch.setattr(atomic_files, "fcntl", None)
    with reserved([tmp_path / "a.h5"]), replacing(tmp_path / "a.h5"):
        pass
    assert sorted(os.listdir(tmp_path)) == [perhaps_living.name, "a.h5"]
