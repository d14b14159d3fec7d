"""Summary: says which results of the survey are confirmed, contradicted or not tried.

The index page opens with a list of at most ten points. Their numbers come from the figures'
pages. A point whose number would be zero is left out.
"""
from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from gpgpu_rt.report.verdict_words import WORDS, score
from gpgpu_rt.text_format import counted

from . import verdicts
from .catalogue import FIGURES, figure_of, of_survey
from .verdicts import LEAST_PAIRS, LEAST_SCENES, Verdict


@dataclass(frozen=True)
class Judged:
    """A figure of the survey: its title and its verdict."""

    title: str
    verdict: Verdict

    @property
    def figure(self) -> str:
        """The number of the figure, such as ``Figure 8``."""
        return self.title.partition(":")[0]

    @property
    def topic(self) -> str:
        """What the figure shows, such as ``a teapot in a stadium``."""
        return self.title.partition(": ")[2]


def sentences(pages: dict[str, dict[str, Any]]) -> list[str]:
    """Return the points of the list, at most ten.

    ``pages`` maps the name of a figure to the content of its page's JSON file.
    """
    own = {name: page for name, page in pages.items() if of_survey(name)}
    judged = [Judged(FIGURES[name], verdict) for name, page in own.items()
              if (verdict := Verdict.from_json(page["verdict"])) is not None]

    def of(*words: str) -> list[Judged]:
        return [one for one in judged if one.verdict.word in words]
    return [sentence for sentence in (
        _made(own, len(of(verdicts.REDRAWN))),
        _list(of(verdicts.REPRODUCED), "agrees with the survey", "agree with the survey"),
        _list(of(verdicts.ORDER, verdicts.MOSTLY), "agrees with the survey only in part",
              "agree with the survey only in part"),
        _list(of(verdicts.CONTRADICTED, verdicts.REFUTED), "contradicts the survey",
              "contradict the survey"),
        _order(judged),
        *_too_little(of(verdicts.TOO_LITTLE)),
        _not_tried(own, of(verdicts.UNMEASURED))) if sentence]


def _made(own: dict[str, dict[str, Any]], redrawn: int) -> str:
    cells = {cell["file"]: cell["renderer"] for page in own.values() for cell in page["cells"]}
    renderers = sorted({str(renderer) for renderer in cells.values()}
                       or {str(page["drawn"]["renderer"]) for page in own.values()})
    return (f"This program has made {len(own)} of the survey's {sum(map(of_survey, FIGURES))} "
            "figures and tables again"
            + (f", from {counted(len(cells), 'measurement')}" if cells else "")
            + f" on {_and(renderers) or 'no renderer'}"
            + (f"; {redrawn} of them {'is' if redrawn == 1 else 'are'} redrawn but not judged, "
               "because the survey prints no numbers there." if redrawn else "."))


def _list(some: Sequence[Judged], one: str, many: str) -> str:
    """A sentence that lists figures with the score of each verdict; "" for no figures."""
    says = f"{counted(len(some), 'figure')} {one if len(some) == 1 else many}"
    named = [f'{each.figure}, "{each.topic}" ({score(vars(each.verdict))})' for each in some]
    return f"{says}: {'; '.join(named)}." if some else ""


def _order(judged: Sequence[Judged]) -> str:
    """Two sentences on the order of methods in all tables of times, even in tables too small to
    judge; "" if no pair of methods was compared."""
    # Leave out figures that make claims, such as Table 1. Figure 26 has the pairs of Table 1,
    # which must not count twice.
    tables = [one.verdict for one in judged if not one.verdict.claims]
    here = [one.renderer or one for one in tables]
    (agreed, pairs), (ours, all_ours), (others, rest) = (
        (sum(one.agreed for one in some if one is not None and one.agreed is not None),
         sum(one.pairs for one in some if one is not None and one.agreed is not None))
        for some in ([one for one in tables if one.renderer is not None], here,
                     [one.stand_ins for one in here]))
    if not pairs + all_ours + rest:
        return ""
    return (f"In all tables of times together, {agreed} of {counted(pairs, 'pair')} of methods "
            "have the published order in the times predicted for the papers' cards. In the times "
            f"of the present renderer {ours} of {all_ours} pairs have the published order on "
            f"scored scenes, and {others} of {rest} pairs have it on stand-ins, which are never "
            "scored.")


def _too_little(some: Sequence[Judged]) -> list[str]:
    """At most four points on figures with too little data to judge, and on the missing data.

    A point whose number would be zero is left out.
    """
    lacking = [one for one in some if _enough_with_meshes(one.verdict)]
    never = [one for one in some if one not in lacking]
    missing = sorted({scene for one in lacking if one.verdict.stand_ins is not None
                      for scene in one.verdict.stand_ins.scenes})
    said = Counter(one.verdict.stand_ins.word for one in some if one.verdict.stand_ins is not None)
    sentences = [
        (some, f"{counted(len(some), 'figure')} {'has' if len(some) == 1 else 'have'} too little "
         f"data to judge: {_figures(some)}. A verdict needs {LEAST_SCENES} scored scenes. A "
         f"verdict that compares methods also needs {LEAST_PAIRS} pairs of methods."),
        (lacking, f"{len(lacking)} of these figures would have enough data with the papers' "
         f"meshes: {_figures(lacking)}. Stand-ins replaced {counted(len(missing), 'scene')} "
         f"({_and(missing)}). `gpgpu-rt scenes --fetch` gets most of the missing meshes."),
        (said, "Stand-ins are never scored. By the same rules, the stand-ins of "
         f"{counted(sum(said.values()), 'figure')} would give these verdicts: "
         + _and([f"\"{word}\" for {said[word]}" for word in WORDS if said[word]]) + "."),
        (never, f"{len(never)} of these {'stays' if len(never) == 1 else 'stay'} too small to "
         "judge, even with every mesh that this run asks for: "
         f"{_figures(never)}. There, the survey's numbers compare too few methods or scenes.")]
    return [sentence for counts, sentence in sentences if counts]


def _enough_with_meshes(verdict: Verdict) -> bool:
    """Whether the figure could be judged if the stand-ins for missing scenes were scored."""
    aside = verdict.stand_ins
    if aside is None:
        return False
    pairs = verdict.pairs + aside.pairs
    needs_pairs = bool(pairs) or not (verdict.claims or aside.claims)
    return (len({*verdict.scenes, *aside.scenes}) >= LEAST_SCENES
            and (pairs >= LEAST_PAIRS or not needs_pairs))


def _not_tried(own: dict[str, dict[str, Any]], unmeasured: Sequence[Judged]) -> str:
    quick = [name for name, page in own.items() if page["size"] == "quick"]
    scenes = {size: {cell.scene for name in quick for cell in figure_of(name).cells(size)}
              for size in (True, False)}
    left = sorted(scenes[True] - scenes[False])
    said = [f"all measurements are missing for {counted(len(unmeasured), 'figure')} "
            f"({_figures(unmeasured)})"] if unmeasured else []
    if left:
        said.append(f"the quick size leaves out {counted(len(left), 'scene')} ({_and(left)})")
    text = ", and ".join(said)
    return f"{text[0].upper()}{text[1:]}." if text else ""


def _figures(some: Iterable[Judged]) -> str:
    return _and([one.figure for one in some])


def _and(words: Sequence[str]) -> str:
    """The words as a list: ``a, b and c``."""
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))
