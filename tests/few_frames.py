"""What moves on a page is drawn four times a second: sixty would be most of a test's work, and show the same.

Somebody who waits for a car may let its page's time fly with HASTE: as many pictures, one after another.
"""

from typing import Final

FEW_FRAMES: Final = """
(() => {
  const ask = window.requestAnimationFrame.bind(window), forget = window.cancelAnimationFrame.bind(window);
  const asked = new Map();
  let last = 0;
  window.requestAnimationFrame = (draw) => {
    const id = ++last;
    asked.set(id, () => clearTimeout(timer));
    const timer = setTimeout(() => {
      const frame = ask((time) => (asked.delete(id), draw(time * (window.haste ?? 1))));
      asked.set(id, () => forget(frame));
    }, window.haste ? 0 : 240);
    return id;
  };
  window.cancelAnimationFrame = (id) => (asked.get(id)?.(), asked.delete(id));
})()
"""
"""A script for a page, before its own."""

HASTE: Final = "window.haste = 15"
"""For a page with few frames, until it is loaded anew: a frame of the browser is told as a quarter of a second."""
