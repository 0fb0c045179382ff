"""Old names, until what-if and compare have moved."""

from __future__ import annotations

from tolstat.answers.report.report_answer import AllLimits as JointFindings

__all__ = ["JointFindings"]
