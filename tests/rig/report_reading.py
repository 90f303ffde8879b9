"""Reads a report as a browser would, strictly: every element closed in order, nothing from outside."""

from dataclasses import dataclass, field
from html.parser import HTMLParser
from io import BytesIO

from matplotlib.figure import Figure

VOID = {"meta", "br", "link", "img"}
FETCHING = {"src", "srcset", "data", "action", "poster", "background"}


def open_fonts():
    """matplotlib keeps the font files it has drawn with open; here they are opened before open files are counted."""
    figure = Figure()
    figure.suptitle("a – b")
    figure.savefig(BytesIO())


@dataclass
class Reader(HTMLParser):
    """What a page holds; AssertionError where it is not well-formed or not self-contained."""

    open: list = field(default_factory=list)
    tags: list = field(default_factory=list)
    ids: list = field(default_factory=list)
    links: list = field(default_factory=list)
    labels: list = field(default_factory=list)
    text: str = ""

    def __post_init__(self):
        super().__init__()

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            assert name not in FETCHING, f"<{tag}> has {name}"
            assert not name.startswith("on"), f"<{tag}> has a script in {name}"
            if name == "id":
                self.ids.append(value)
            if name == "href":
                assert value.startswith("#"), f"<{tag}> leads to {value}"
                self.links.append(value[1:])
            if name == "aria-label":
                self.labels.append(value)
        assert tag not in {"script", "iframe", "object", "link"}
        self.tags.append(tag)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> closes {self.open}"

    def handle_data(self, text):
        self.text += text


def read(page: str) -> Reader:
    """The page read to its end, all ids different, all links within it."""
    reader = Reader()
    reader.feed(page)
    reader.close()
    assert reader.open == []
    assert len(set(reader.ids)) == len(reader.ids)
    assert set(reader.links) <= set(reader.ids)
    for sign in ("http:", "https:", "//", "@import", 'url("', "url('"):
        assert sign not in page, f"{sign} in the page"
    return reader
