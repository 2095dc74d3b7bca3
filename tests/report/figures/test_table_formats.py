"""The texts of a table, word for word."""

import csv
import io

import pytest

from harness.errors import UnknownName
from harness.report.figures.table import MetricValue, ResultsRow, ResultsTable
from harness.report.figures.table_formats import format_table

ANGLE, JITTER = "joint_angle_mean_deg", "jitter_m_s3"
TABLE = ResultsTable(
    ("noise",),
    (ANGLE, JITTER),
    (
        ResultsRow(
            ("clean",),
            "expert_map",
            (
                MetricValue(ANGLE, 1.0974, 0.9611, 1.2368, 8, "lowest", True),
                MetricValue(JITTER, 1234.5, 900.0, 1400.0, 8),
            ),
        ),
        ResultsRow(
            ("clean",),
            "ik[a|b,x_1=50%]",
            (MetricValue(ANGLE, 2.5943, 2.4, 2.8, 8, "worse"), MetricValue(JITTER, None)),
        ),
        ResultsRow(
            ("default",), "ik", (MetricValue(ANGLE, 4.02, None, None, 1), MetricValue(JITTER, -3.0, -4.0, 2.0, 8))
        ),
    ),
    "Mean over clips.",
)
LATEX = r"""% needs \usepackage{booktabs}
% Mean over clips.
\begin{tabular}{llrrr}
\toprule
noise & method & clips & joint angle error [deg] & jitter [m/s\textsuperscript{3}] \\
\midrule
clean & expert\_map & 8 & \textbf{1.10} [0.96, 1.24] & 1,234.5 [900.0, 1,400.0] \\
 & ik[a\textbar{}b,x\_1=50\%] & 8 & 2.59 [2.40, 2.80] & -- \\
\addlinespace
default & ik & 8 & 4.02 & $-$3.0 [$-$4.0, 2.0] \\
\bottomrule
\end{tabular}
"""
MARKDOWN = r"""| noise | method | clips | joint angle error [deg] | jitter [m/s³] |
| --- | --- | --: | --: | --: |
| clean | `expert_map` | 8 | **1.10** [0.96, 1.24] | 1,234.5 [900.0, 1,400.0] |
| clean | `ik[a\|b,x_1=50%]` | 8 | 2.59 [2.40, 2.80] | – |
| default | `ik` | 8 | 4.02 | −3.0 [−4.0, 2.0] |

Mean over clips.
"""
CSV = (
    "noise,method,joint_angle_mean_deg,joint_angle_mean_deg.low,joint_angle_mean_deg.high,joint_angle_mean_deg.clips,"
    "joint_angle_mean_deg.standing,jitter_m_s3,jitter_m_s3.low,jitter_m_s3.high,jitter_m_s3.clips,jitter_m_s3.standing\n"
    "clean,expert_map,1.0974,0.9611,1.2368,8,lowest,1234.5,900,1400,8,\n"
    'clean,"ik[a|b,x_1=50%]",2.5943,2.4,2.8,8,worse,,,,0,\n'
    "default,ik,4.02,,,1,,-3,-4,2,8,\n"
)


@pytest.mark.parametrize(("fmt", "text"), [("latex", LATEX), ("markdown", MARKDOWN), ("csv", CSV)])
def test_texts(fmt: str, text: str) -> None:
    assert format_table(TABLE, fmt) == text


def test_a_csv_reads_back_as_what_was_written() -> None:
    head, *rows = csv.reader(io.StringIO(format_table(TABLE, "csv")))
    assert {len(row) for row in rows} == {len(head)}
    assert [row[1] for row in rows] == [row.method for row in TABLE.rows]


def test_no_name_is_a_formula_or_markup() -> None:
    table = ResultsTable(("noise",), (ANGLE,), (ResultsRow(("=a[b](c)$",), "-a`|b", (MetricValue(ANGLE, -1.0),)),), "")
    assert format_table(table, "csv").splitlines()[1] == "'=a[b](c)$,'-a`|b,-1,,,0,"
    assert "| =a[b]\\(c)\\$ | ``-a`\\|b`` | 0 | −1.00 |" in format_table(table, "markdown")
    assert "=a[b](c)\\$ & -a`\\textbar{}b & 0 &" in format_table(table, "latex")


def test_a_row_of_latex_never_begins_with_a_bracket() -> None:
    """LaTeX would read it as the argument of the row before."""
    table = ResultsTable((), (ANGLE,), (ResultsRow((), "[x]", (MetricValue(ANGLE, 1.0),)),), "")
    assert "\n{}[x] & 0 & 1.00 \\\\\n" in format_table(table, "latex")


def test_another_format_is_refused() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'latex'"):
        format_table(TABLE, "latx")
