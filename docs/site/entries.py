"""Entries of the reference that the search finds by their names: variables of FMUs, and keys of files.
Part of the manual's site.

    {variable}`CRMPC.guarantee.inForce`      {key}`campaign.Limit.at_most`

A variable shows what stands behind the first dot, a key only its last part.
"""

from docutils import nodes
from sphinx.util.docutils import SphinxRole


class Entry(SphinxRole):
    def run(self):
        kind = self.name.rpartition(":")[2]
        text = self.text.partition(".")[2] if kind == "variable" else self.text.rpartition(".")[2]
        node = nodes.literal(self.rawtext, text, ids=[self.text], classes=["entry"])
        self.env.domains.standard_domain.note_object(kind, self.text, self.text, location=node)
        return [node], []


def setup(app):
    for kind in ("variable", "key"):
        app.add_object_type(kind, f"{kind}-reference", objname=kind)
        app.add_role_to_domain("std", kind, Entry(), override=True)
    return {"parallel_read_safe": False}
