"""Draw frames.svg, the picture of docs/conventions.md, with projected rather than guessed axes.

Usage: python docs/images/draw_frames.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 1000, 800
X, Y, Z = "#c62828", "#2e7d32", "#1565c0"
INK, FAINT, PAPER = "#222222", "#8a8a8a", "#f3efe6"


class Drawing:
    """SVG elements, in the order in which they are painted."""

    def __init__(self) -> None:
        self.parts: list[str] = []

    def line(self, a, b, color=INK, width=1.5, *, dash="", arrow=False) -> None:
        """Straight line from a to b."""
        marker = f' marker-end="url(#arrow-{color[1:]})"' if arrow else ""
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<line x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}" '
            f'stroke="{color}" stroke-width="{width}"{dashes}{marker}/>'
        )

    def polygon(self, points, fill="none", color=INK, width=1.5) -> None:
        """Closed outline."""
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.parts.append(
            f'<polygon points="{text}" fill="{fill}" stroke="{color}" stroke-width="{width}" '
            f'stroke-linejoin="round"/>'
        )

    def dot(self, at, color=INK, radius=3.5) -> None:
        """Point."""
        self.parts.append(
            f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius}" fill="{color}"/>'
        )

    def text(self, at, words, color=INK, size=15, *, anchor="start", bold=False) -> None:
        """Words whose baseline begins at a point."""
        weight = ' font-weight="bold"' if bold else ""
        self.parts.append(
            f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" fill="{color}" font-size="{size}" '
            f'text-anchor="{anchor}"{weight}>{words}</text>'
        )

    def axes(self, origin, ends, names=("x", "y", "z"), width=2.5) -> None:
        """Three arrows from an origin; names stand beyond their tips."""
        for end, name, color in zip(ends, names, (X, Y, Z), strict=True):
            self.line(origin, end, color, width, arrow=True)
            away = np.subtract(end, origin)
            tip = np.add(end, 15 * away / max(float(np.linalg.norm(away)), 1e-9))
            self.text((tip[0], tip[1] + 5), name, color, 16, anchor="middle", bold=True)

    def svg(self) -> str:
        """The whole file."""
        markers = "".join(
            f'<marker id="arrow-{c[1:]}" viewBox="0 0 10 10" refX="8" refY="5" markerWidth="6" '
            f'markerHeight="6" orient="auto-start-reverse">'
            f'<path d="M0,0.8 L10,5 L0,9.2 z" fill="{c}"/></marker>'
            for c in (X, Y, Z, INK, FAINT)
        )
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
            f'font-family="DejaVu Sans, Verdana, sans-serif">\n<defs>{markers}</defs>\n'
            f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>\n'
            + "\n".join(self.parts)
            + "\n</svg>\n"
        )


class Projection:
    """Parallel projection of a world with z up, seen from behind, the right and above."""

    def __init__(self, origin, scale, azimuth=35.0, elevation=22.0) -> None:
        a, e = np.radians(azimuth), np.radians(elevation)
        right = np.array([np.cos(a), np.sin(a), 0.0])
        up = np.array([-np.sin(a) * np.sin(e), np.cos(a) * np.sin(e), np.cos(e)])
        self._matrix = scale * np.stack([right, -up])
        self._origin = np.asarray(origin, float)

    def __call__(self, points) -> np.ndarray:
        """N×3 points of the world to N×2 points of the page."""
        return np.asarray(points, float) @ self._matrix.T + self._origin


def scene(d: Drawing) -> None:
    """Camera and object, and the pose between them."""
    d.text((20, 34), "Camera and object", size=19, bold=True)
    # World: x to the right of the camera, y forward, z up.
    to_page = Projection((95, 305), 118)
    eye = np.array([0.0, 0.0, 0.0])
    axes = np.array([[0.8, 0, 0], [0, 0, -0.8], [0, 1.0, 0]])  # right, down, forward
    corners = np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]]) * (0.36, 0.27)
    image = np.array([[u, 0.55, v] for u, v in corners])
    for corner in image:
        d.line(to_page(eye), to_page(corner), FAINT, 1)
    d.polygon(to_page(image), "#e8eef7", FAINT)
    d.axes(to_page(eye), to_page(eye + axes))
    d.text((20, 205), "camera: its optical frame", bold=True)
    d.text((20, 223), "x right, y down, z forward", FAINT, 13)

    # The face looks back at the camera, a little turned and tilted.
    centre = np.array([0.9, 2.55, 0.1])
    face_z = -centre / np.linalg.norm(centre)
    face_z = face_z + np.array([0.55, 0.0, 0.15])
    face_z /= np.linalg.norm(face_z)
    face_x = np.cross([0, 0, 1.0], face_z)
    face_x /= np.linalg.norm(face_x)
    face_y = np.cross(face_z, face_x)
    w, h = 1.7, 1.1
    face = [
        centre + a * w / 2 * face_x + b * h / 2 * face_y
        for a, b in ((-1, 1), (1, 1), (1, -1), (-1, -1))
    ]
    d.polygon(to_page(face), PAPER, INK, 2)
    d.axes(
        to_page(centre),
        to_page([centre + 1.15 * face_x, centre + 0.9 * face_y, centre + 0.9 * face_z]),
    )
    d.dot(to_page(centre))
    start, end = to_page(eye), to_page(centre)
    d.line(
        start + 0.04 * (end - start), start + 0.97 * (end - start), INK, 1.3, dash="6 5", arrow=True
    )
    middle = start + 0.62 * (end - start)
    d.text((middle[0] - 50, middle[1] + 64), "T_camera_object", bold=True)
    d.text((250, 78), "object: a face, its origin at the centre", bold=True)
    d.text((250, 96), "x right, y up, z out of it, towards the viewer", FAINT, 13)


def reference(d: Drawing) -> None:
    """The reference image in edge coordinates, with the paper's three points."""
    left, top, cell, columns, rows = 600, 110, 42, 8, 5
    w, h = columns * cell, rows * cell
    d.text((565, 34), "Reference image, edge coordinates", size=19, bold=True)
    d.parts.append(
        f'<rect x="{left}" y="{top}" width="{w}" height="{h}" fill="{PAPER}" stroke="none"/>'
    )
    for i in range(1, columns):
        d.line((left + i * cell, top), (left + i * cell, top + h), "#d9d2c2", 1)
    for i in range(1, rows):
        d.line((left, top + i * cell), (left + w, top + i * cell), "#d9d2c2", 1)
    d.polygon([(left, top), (left + w, top), (left + w, top + h), (left, top + h)], width=2)
    d.line((left, top), (left + 100, top), INK, 2.5, arrow=True)
    d.line((left, top), (left, top + 100), INK, 2.5, arrow=True)
    d.text((left + 92, top - 9), "u", bold=True)
    d.text((left - 18, top + 98), "v", bold=True)
    d.dot((left, top))
    d.text((left - 6, top - 28), "(0, 0): outer corner of the first pixel", size=13)
    d.dot((left + cell / 2, top + cell / 2), FAINT, 3)
    d.text((left + cell / 2 + 7, top + cell / 2 + 14), "(½, ½): its centre", FAINT, 12)
    d.dot((left + w, top + h))
    d.text((left + w + 4, top + h + 20), "(w, h)", size=13, anchor="end")
    p_c, p_x, p_y = (left + w / 2, top + h / 2), (left + w, top + h / 2), (left + w / 2, top)
    d.line(p_c, p_x, X, 2.5, arrow=True)
    d.line(p_c, p_y, Y, 2.5, arrow=True)
    for point in (p_c, p_x, p_y):
        d.dot(point, radius=4)
    d.text((p_c[0] - 8, p_c[1] + 24), "p_c = (w/2, h/2)", size=14, anchor="middle")
    d.text((p_x[0] - 8, p_x[1] + 24), "p_x = (w, h/2)", size=14, anchor="end")
    d.text((p_y[0] + 12, p_y[1] + 24), "p_y = (w/2, 0)", size=14)
    d.text((p_c[0] + 60, p_c[1] - 9), "x", X, 16, bold=True)
    d.text((p_c[0] - 18, p_c[1] - 44), "y", Y, 16, bold=True)


def box(d: Drawing) -> None:
    """A box with its sides, whole and unfolded."""
    d.text((20, 454), "Box", size=19, bold=True)
    to_page = Projection((185, 640), 95, azimuth=32.0, elevation=24.0)

    # World of the projection: box x = world x, box y = world z, box z = -world y.
    def at(p):
        return to_page(np.stack([p[..., 0], -p[..., 2], p[..., 1]], axis=-1))

    size = np.array([1.3, 1.7, 0.95])
    quads = {
        "front": [(-1, 1, 1), (1, 1, 1), (1, -1, 1), (-1, -1, 1)],
        "right": [(1, 1, 1), (1, 1, -1), (1, -1, -1), (1, -1, 1)],
        "top": [(-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)],
    }
    for name, fill in (("front", PAPER), ("right", "#e6dfd0"), ("top", "#faf8f2")):
        quad = np.array(quads[name]) * size / 2
        d.polygon(at(quad), fill, INK, 2)
        place = quad.mean(axis=0) if name != "front" else np.array([0.0, -1.4, 0.95]) / 2
        spot = at(np.asarray(place))
        beside = {"front": (0, 5), "right": (2, 42), "top": (-34, 5)}[name]
        d.text(spot + beside, name, FAINT, 14, anchor="middle")
    centre = np.zeros(3)
    ends = np.diag([1.15, 1.45, 1.35])
    surface = size / 2
    for i, end in enumerate(ends):
        exit_point = end * surface[i] / end[i]
        color = (X, Y, Z)[i]
        d.line(at(centre), at(exit_point), color, 2, dash="4 4")
        d.line(at(exit_point), at(end), color, 2.5, arrow=True)
        tip = at(end) + 15 * (at(end) - at(centre)) / np.linalg.norm(at(end) - at(centre))
        d.text((tip[0], tip[1] + 5), "xyz"[i], color, 16, anchor="middle", bold=True)
    d.dot(at(centre))
    d.text((330, 600), "origin at its centre,", FAINT, 13)
    d.text((330, 617), "T_object_face places", FAINT, 13)
    d.text((330, 634), "each side", FAINT, 13)

    net(d, (610, 565), np.array([86, 112, 63]))


def net(d: Drawing, front, size) -> None:
    """The unfolded box: how each photo is upright."""
    w, h, depth = size
    x, y = front
    d.text((565, 454), "Which way up its photos are", size=19, bold=True)
    sides = {
        "front": (x + depth, y, w, h),
        "left": (x, y, depth, h),
        "right": (x + depth + w, y, depth, h),
        "back": (x + 2 * depth + w, y, w, h),
        "top": (x + depth, y - depth, w, depth),
        "bottom": (x + depth, y + h, w, depth),
    }
    for name, (left, top, width, height) in sides.items():
        fill = PAPER if name == "front" else "#ffffff"
        d.polygon(
            [(left, top), (left + width, top), (left + width, top + height), (left, top + height)],
            fill,
        )
        middle = left + width / 2
        d.line((middle, top + height / 2 - 2), (middle, top + 10), Y, 2, arrow=True)
        d.text((middle, top + height / 2 + 16), name, INK, 14, anchor="middle")
    d.text((x + 2 * depth + w + 14, y - 40), "the arrow is y of the", FAINT, 13)
    d.text((x + 2 * depth + w + 14, y - 22), "face: up in its photo", FAINT, 13)


def main() -> None:
    """Write the picture beside this script."""
    drawing = Drawing()
    scene(drawing)
    reference(drawing)
    box(drawing)
    drawing.line((20, 425), (980, 425), "#dddddd", 1)
    Path(__file__).with_name("frames.svg").write_text(drawing.svg(), encoding="utf-8")


if __name__ == "__main__":
    main()
