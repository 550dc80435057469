"""A page as tests read it."""

from html.parser import HTMLParser

VOID = {"meta", "img", "br", "link", "input"}


class Page(HTMLParser):
    """Tags with attributes, the text of each table row, and proof that tags are balanced."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags = []
        self.rows = []
        self.words = []
        self._open = []
        self.feed(html)
        assert self._open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag == "tr":
            self.rows.append([])
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        if {"style", "script"} & {*self._open} or not data.strip():
            return
        self.words.append(" ".join(data.split()))
        if "tr" in self._open:
            self.rows[-1].append(self.words[-1])

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]

    def row(self, start):
        return next(row for row in self.rows if row[: len(start)] == start)
