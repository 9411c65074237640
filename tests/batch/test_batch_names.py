"""Which files are meant, and what their results are called."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting.batch.names import names
from fitting.batch.receipt import Receipt
from fitting.cli.batch_plan import expand
from fitting.cli.failures import UsageError
from fitting.cli.reading import stem


def named(*paths: str, there: dict[str, str] | None = None) -> list[str]:
    receipts = {
        name: Receipt(name, source, source, "", "", "done")
        for name, source in (there or {}).items()
    }
    return names([Path(p) for p in paths], stem, receipts)


@pytest.mark.parametrize(
    ("paths", "expected"),
    [
        (["/d/a.astm", "/d/b.astm"], ["a", "b"]),
        (["/d/a.astm.gz"], ["a"]),
        (["/a/x.astm", "/b/x.astm"], ["a__x", "b__x"]),
        (["/d/x.astm", "/d/x.csv"], ["x.astm", "x.csv"]),
        (["/1/s/x.astm", "/2/s/x.astm"], ["1__s__x", "2__s__x"]),
        (["/a/x.astm", "/b/x.astm", "/a/y.astm"], ["a__x", "b__x", "y"]),
    ],
)
def test_names_tell_files_apart(paths: list[str], expected: list[str]):
    assert named(*paths) == expected


def test_names_stay_when_files_are_added():
    there = {"x": "/a/x.astm"}
    assert named("/a/x.astm", "/b/x.astm", there=there) == ["x", "b__x"]


def test_the_result_of_another_file_is_not_overwritten():
    assert named("/b/x.astm", there={"x": "/a/x.astm"}) == ["x.astm"]
    both = {"x": "/a/x.astm", "x.astm": "/c/x.astm"}
    assert named("/b/x.astm", there=both) == ["b__x"]


_PARTS = st.sampled_from(["a", "b", "a__b", "x"])
_PATHS = st.lists(
    st.builds(
        lambda folders, file, suffix: "/" + "/".join([*folders, f"{file}{suffix}"]),
        st.lists(_PARTS, max_size=3), _PARTS, st.sampled_from(["", ".astm", ".csv"]),
    ),
    min_size=1, max_size=8, unique=True,
)  # fmt: skip


@given(_PATHS, _PATHS)
def test_no_two_files_share_a_name(first: list[str], second: list[str]):
    earlier = named(*first)
    assert len(set(earlier)) == len(first)
    later = named(*second, there=dict(zip(earlier, first, strict=True)))
    assert len(set(later)) == len(second)
    of_first = dict(zip(first, earlier, strict=True))
    for path, name in zip(second, later, strict=True):
        if path in of_first:
            assert name == of_first[path]
        else:
            assert name not in earlier


def test_patterns_and_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub" / "deep").mkdir(parents=True)
    for name in ("b.astm", "a.astm", "a[1].astm", "sub/c.astm", "sub/deep/d.astm"):
        (tmp_path / name).touch()
    assert expand(["*.astm"]) == ["a.astm", "a[1].astm", "b.astm"]
    assert expand(["b.astm", "*.astm", "./b.astm"]) == ["b.astm", "a.astm", "a[1].astm"]
    assert expand(["a[1].astm"]) == ["a[1].astm"]
    assert expand(["sub/**/*.astm"]) == ["sub/c.astm", "sub/deep/d.astm"]
    with pytest.raises(UsageError, match=r"'sub/\*\.astm'"):
        expand(["sub"])
    with pytest.raises(UsageError, match="no file matches"):
        expand(["b.astm", "*.csv"])
