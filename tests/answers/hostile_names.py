"""Names that could end a tag, a formula or a table."""

from __future__ import annotations

from dataclasses import replace

from tests.conftest import Toy


class Quoted(Toy):
    """A toy whose words mean something in HTML."""

    def describe(self, settings):
        gap, ratio = super().describe(settings).responses
        quoted = replace(gap, symbol='"<b>', sentence='a <b> in "quotes"', source="<i>")
        return super().describe(settings)._replace(responses=(quoted, ratio))


HOSTILE = '<script>alert("1")</script> & "quotes" \'ticks\''
