"""The pictures of docs/effects.md, which ``docs/catalogue_pictures.py`` draws."""
