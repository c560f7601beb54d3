"""How often a page draws cars in 3D."""

COUNT_FRAMES = """
    window.drawnFrames = 0;
    let last = -1;
    for (const name of ["drawElementsInstanced", "drawArraysInstanced"]) {
      const draw = WebGL2RenderingContext.prototype[name];
      WebGL2RenderingContext.prototype[name] = function (...all) {
        const now = document.timeline.currentTime; // of the frame
        window.drawnFrames += now !== last;
        last = now;
        draw.apply(this, all);
      };
    }
"""
"""For a page before it opens: counts the frames in which cars were drawn; one painted without them is none."""
