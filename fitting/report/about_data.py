"""What was measured, what was left out, and what the reader of the file noticed."""

from __future__ import annotations

from fitting import physics
from fitting.quantities import channel_span, count, degrees, percent
from fitting.report.blocks import Block, Bullets, Table, Terms, Words
from fitting.report.reported import Reported


def blocks(about: Reported) -> list[Block]:
    """Facts, notes, and the albedo and coverage of every angle of incidence."""
    data = about.result.data
    facts = [
        ("File", data.path),
        ("Format", data.format),
        ("Sample", data.sample),
        ("Instrument", data.instrument),
        ("Date", data.date),
        ("Symmetry", data.symmetry),
        ("Channels", channel_span([c.name for c in about.result.channels])),
        ("Rows", f"{data.rows}, of which {data.rows_used} were fitted"),
        ("SHA-256", data.sha256),
    ]
    out: list[Block] = [Terms([(k, v) for k, v in facts if v])]
    if about.why:
        out.append(Words(f"About the file now: {about.why}."))
    said = [f"left out: {text}" for text in data.left_out]
    said += [_note(n.sentence, n.count) for n in data.notes]
    out.append(Bullets(said) if said else Words("The reader had nothing to remark."))
    if data.albedo:
        through = any(a.transmitted is not None for a in data.albedo)
        columns = ["theta_i / deg", "albedo", "hemisphere covered"]
        columns += ["transmitted", "covered there"] if through else []
        rows = [
            (degrees(a.theta_i_deg), f"{a.albedo:.3f}", percent(a.covered),
             *(_transmitted(a.transmitted, a.transmitted_covered) if through else ()))
            for a in data.albedo
        ]  # fmt: skip
        title = "What the data sum to, in the channel where that is most"
        out.append(Table("data-albedo", title, columns, rows))
    return out


def constraints(about: Reported) -> list[Block]:
    """Energy and reciprocity, of the fit and of the data, and the weights of both."""
    result = about.result
    weights = [
        f"weight of the penalty on an albedo above 1: {_weight(result.energy.weight)}"
        if result.energy.constraint != "hard"
        else "coefficients were bounded so that no albedo can exceed 1",
        "no penalty on the exchange of directions was needed"
        if result.reciprocity.weight is None
        else "weight of the penalty on the exchange of directions: "
        f"{_weight(result.reciprocity.weight)}",
    ]
    return [
        Words("Of the fit:"),
        Bullets(physics.of_fit(result)),
        Words("Of the data:"),
        Bullets(physics.of_data(result)),
        Words("Constraints:"),
        Bullets(weights),
    ]


def _note(sentence: str, n: int) -> str:
    return f"{sentence} ({count(n, 'time')})" if n and str(n) not in sentence else sentence


def _transmitted(share: float | None, covered: float | None) -> tuple[str, str]:
    return (
        "-" if share is None else f"{share:.3f}",
        "-" if covered is None else percent(covered),
    )


def _weight(weight: float | None) -> str:
    return "none" if not weight else f"{weight:g}"
