"""What the page in a browser's tab is told: tracks, settings and rewards, as files beside it.

    tracks, settings, presets -> *plan*, *javascript* -> build/site/data -> web/src/tab

`python -m racecraft.site build/site` writes them, and which files there are; `make site` does.
docs/tab.md says what the page makes of them.
"""
