"""What every page must be, whatever it says."""

import re
from html.parser import HTMLParser


class Checker(HTMLParser):
    """Every tag is closed, every resource is inside, nothing is fetched."""

    VOID = ("meta", "img", "br", "input")

    def check(self, page, n_images, *, scripts=0):
        self.open, self.images, self.tags = [], 0, []
        self.feed(page)
        assert self.open == []
        assert self.images == n_images
        assert self.tags.count("script") == scripts
        assert not {"link", "iframe", "object", "base"} & set(self.tags)
        assert "url(" not in page
        assert "@import" not in page
        assert not re.search(r"https?://", page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        values = dict(attrs)
        if tag == "img":
            self.images += 1
            # The slider's two pictures are filled from those of the gallery.
            assert "src" not in values or values["src"].startswith("data:image/png;base64,iVBOR")
            assert values["alt"] or "src" not in values
        assert "src" not in values or tag == "img"
        assert values.get("href", "#").startswith("#")
        assert not any(name.startswith("on") for name in values)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
