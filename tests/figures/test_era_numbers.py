"""The page of number formats marks the rows that a card with fp24 could not run."""
from __future__ import annotations

from gpgpu_rt.figures.experiments import era_numbers
from gpgpu_rt.hardware import methods_on_cards


def test_rows_beyond_the_index_of_fp24_are_marked(monkeypatch) -> None:
    for texels, beyond in ((131_072, False), (131_073, True)):
        def measured(names: list[str], scene: str, *, era: str, texels: int = texels
                     ) -> dict[str, int]:
            assert era == "r420"    # the row's own option
            return {names[0]: texels}
        monkeypatch.setattr(era_numbers, "era_texels", measured)
        assert era_numbers.beyond_index("cornell", "grid, fp24") == beyond
        assert not era_numbers.beyond_index("cornell", "bvh-threaded, fp32")
        assert not era_numbers.beyond_index("cornell", "Ray Engine, R200")
    assert "rows marked with `(index)`" in era_numbers.ABOUT


def test_the_tables_of_cornell_can_be_indexed() -> None:
    assert methods_on_cards.era_texels(["grid"], "cornell")["grid"] <= 131_072
    assert not era_numbers.beyond_index("cornell", "grid, fp24")
