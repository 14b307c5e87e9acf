"""An independent plant, from the equations of the corrected model alone.

Its forms differ from the project's simulator: slipping sets in smoothly, ideal rolling has an elastic
sideslip, and every effect that is hidden has a form of its own (``equations``). ``effects`` draws sizes,
``world`` drives and measures.
"""
