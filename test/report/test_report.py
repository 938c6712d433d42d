import base64
import csv
import re

import pytest
from replayed import changed, write_replayed

from idem_ros.files.atomic_file import UnwritableFile
from idem_ros.report import plots as report_plots
from idem_ros.report.folder import write_report


@pytest.fixture(scope='module', autouse=True)
def _few_measures():
    """Errors alone: to draw every measure takes seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report_plots, 'MEASURES', report_plots.MEASURES[:1])
        yield


@pytest.fixture(scope='module')
def drawn(tmp_path_factory):
    """A result, the page of its report, and what was said of the progress."""
    folder, said = tmp_path_factory.mktemp('drawn'), []

    def progress(frames, total):
        frames = list(frames)
        said.extend([total, len(frames)])
        return frames

    result = write_replayed(folder)
    return result, write_report([result], folder / 'report', progress), said


def links(page):
    """Return {file name: content} of what can be downloaded from the page itself."""
    found = re.findall(r'<a download="([^"]+)" href="data:text/csv;base64,([^"]+)"', page)
    return {name: base64.b64decode(content).decode() for name, content in found}


def test_a_report_is_a_page_with_its_pictures_and_tables_beside(drawn):
    result, page, _ = drawn
    assert page == result.parent / 'report' / 'report.html'
    names = {file.name for file in page.parent.iterdir()}
    expected = {'frames_result.csv', 'worst_result.csv', 'translation_error_m_over_time.png'}
    assert expected | {'worst_result_0_q_tot.png'} <= names
    assert {name.rpartition('.')[2] for name in names} == {'html', 'png', 'csv'}


def test_what_can_be_downloaded_is_what_lies_beside(drawn):
    _, page, _ = drawn
    downloads = links(page.read_text())
    beside = {file.name: file.read_text() for file in page.parent.glob('*.csv')}
    assert downloads == beside
    assert len(list(csv.reader(beside['frames_result.csv'].splitlines()))) == 5


def test_a_name_that_is_not_utf_8_is_shown_with_its_bytes_escaped(tmp_path):
    result = write_replayed(tmp_path, n=1)
    strange = result.rename(result.with_name('re\udcffsult.json'))
    page = write_report([strange], tmp_path / 'report').read_text()
    assert 're\\udcffsult' in page


def test_the_same_results_give_the_same_report_to_the_byte(drawn, tmp_path):
    result, page, _ = drawn
    contents = [
        {file.name: file.read_bytes() for file in each.parent.iterdir()}
        for each in (page, write_report([result], tmp_path / 'second'))
    ]
    assert contents[0] == contents[1]


def test_files_of_several_results_are_told_apart_whatever_they_are_called(tmp_path):
    result = write_replayed(tmp_path, n=1)
    other = changed(result, lambda record: None, 'a <b>&$\n')
    folder = write_report([result, other], tmp_path / 'report').parent
    names = {file.name for file in folder.glob('frames_*.csv')}
    assert names == {'frames_1_result.csv', 'frames_2_a_b_.csv'}


def test_a_folder_that_is_not_empty_is_refused_before_any_work(tmp_path):
    with pytest.raises(UnwritableFile, match='is not empty'):
        write_report([tmp_path / 'none.json'], write_replayed(tmp_path).parent)


def test_a_full_disk_leaves_nothing(tmp_path, monkeypatch):
    def no_space(*_):
        raise OSError(28, 'No space left on device')

    result = write_replayed(tmp_path, n=1)
    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr('pathlib.Path.write_bytes', no_space)  # of the pictures, after the page
    with pytest.raises(UnwritableFile, match='No space left'):
        write_report([result], tmp_path / 'report')
    assert sorted(tmp_path.iterdir()) == before


def test_progress_counts_the_frames_that_are_drawn(drawn):
    _, _, said = drawn
    assert said == [4, 4]
