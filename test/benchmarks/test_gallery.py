from pathlib import Path

from benchmarks.gallery import MOST_BYTES

DOCS = Path(__file__).resolve().parents[2] / 'docs'


def test_pictures_of_the_gallery_are_small_and_each_is_shown():
    pictures = list((DOCS / 'gallery').iterdir())
    text = (DOCS / 'gallery.md').read_text()
    assert all(f'(gallery/{picture.name})' in text for picture in pictures)
    assert len(pictures) == text.count('(gallery/')
    assert max(picture.stat().st_size for picture in pictures) <= MOST_BYTES
