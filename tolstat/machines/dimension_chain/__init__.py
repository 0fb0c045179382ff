"""A dimension chain: links, and the gap that they leave, as a formula."""

from tolstat.machines.dimension_chain.chain import Answers, answers
from tolstat.machines.dimension_chain.formula import Formula
from tolstat.machines.dimension_chain.machine import DimensionChain

__all__ = ["Answers", "DimensionChain", "Formula", "answers"]
