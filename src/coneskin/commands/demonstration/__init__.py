"""Parts of ``coneskin demo``: its scene, and what it reports."""
