"""What a panel draws, on a stand-in for Blender's layout."""

from typing import Any

__all__ = ["Layout", "drawn_by"]


class Layout:
    """Notes every call: the name of the method, and what it was given."""

    alert = False

    def __init__(self, calls: list[tuple[str, tuple, dict[str, Any]]] | None = None) -> None:
        self.calls = [] if calls is None else calls

    def __getattr__(self, name: str) -> Any:
        def call(*values: Any, **options: Any) -> "Layout":
            self.calls.append((name, values, options))
            return Layout(self.calls)

        return call

    def words(self) -> list[str]:
        """All text and all names that were given, in order."""
        return [
            value
            for _, values, options in self.calls
            for value in (*values, options.get("text"))
            if isinstance(value, str)
        ]


def drawn_by(panel: Any, context: Any) -> Layout:
    """What a panel or menu draws in this context."""
    layout = Layout()
    panel.draw(type("Owner", (), {"layout": layout})(), context)
    return layout
