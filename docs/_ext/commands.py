"""The directive ``gtao-commands``: a reference of the command line, read from the command itself."""

from typing import Any

import typer
from docutils import nodes
from docutils.parsers.rst import Directive

from gtao.cli import app


def _literal(text: str) -> nodes.literal:
    return nodes.literal(text, text)


def _name(argument: Any) -> str:
    return argument.metavar or argument.name.upper()


def _usage(name: str, command: Any) -> str:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    words = [_name(p) if p.required else f"[{_name(p)}{'' if p.nargs == 1 else ' …'}]" for p in arguments]
    return " ".join(["gtao", name, *words, "[options]"])


def _default(p: Any) -> str:
    if p.required or p.default is None or p.default is False or p.default in ((), []):
        return ""
    return f" Default: {p.default}."


def _item(p: Any) -> nodes.definition_list_item:
    term = nodes.term()
    spellings = [_name(p)] if p.param_type_name == "argument" else [*p.opts, *p.secondary_opts]
    for i, spelling in enumerate(spellings):
        if i:
            term += nodes.Text(", ")
        term += _literal(spelling)
    text = (getattr(p, "help", None) or "").strip()
    text += "" if not text or text.endswith(".") else "."
    body = nodes.paragraph(text=f"{text}{_default(p)}".strip())
    return nodes.definition_list_item("", term, nodes.definition("", body))


class Commands(Directive):
    """One section per subcommand with its usage line, its purpose, and its arguments and options."""

    def run(self) -> list[nodes.Node]:
        sections: list[nodes.Node] = []
        for name, command in typer.main.get_command(app).commands.items():
            section = nodes.section(ids=[f"gtao-{name}"], names=[f"gtao-{name}"])
            section += nodes.title(text=f"gtao {name}")
            section += nodes.literal_block(text=_usage(name, command), language="text")
            section += nodes.paragraph(text=(command.help or "").strip())
            items = [_item(p) for p in command.params if p.name != "help"]
            if items:
                section += nodes.definition_list("", *items)
            sections.append(section)
        return sections


def setup(app: Any) -> dict[str, bool]:
    app.add_directive("gtao-commands", Commands)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
