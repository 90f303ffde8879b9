"""Where the server listens, and what a user is told who asks for what can't be."""

from __future__ import annotations

import os
import sys
from subprocess import run

import pytest

from rig.cli import main
from rig.errors import RigError
from rig.link.live_runs import Run, register
from rig.serve.address import link, listen, served_hosts, warning


def test_it_listens_on_loopback_and_a_port_of_its_own():
    with listen("localhost", 0) as listener:
        address, port = listener.getsockname()
        assert address == "127.0.0.1"
        with pytest.raises(RigError, match=f"--port {port}: another program listens there already"):
            listen("127.0.0.1", port)


@pytest.mark.parametrize(
    ("host", "why"),
    [
        ("bench", "an IP address of this machine was expected"),
        ("", "an IP address of this machine was expected"),
        ("127.0.0.1:80", "an IP address of this machine was expected"),
        ("192.0.2.1", "this machine does not have that address"),  # TEST-NET-1, RFC 5737
    ],
)
def test_addresses_that_cannot_be(host, why):
    with pytest.raises(RigError, match=why):
        listen(host, 0)


def test_names_that_may_be_asked_for():
    assert served_hosts("::1", 9, "bench") == {"[::1]:9", "localhost:9"}
    assert served_hosts("10.0.0.7", 9, "bench") == {"10.0.0.7:9", "bench:9"}


def test_links_and_what_an_open_address_means():
    assert link("127.0.0.1", 8000, "Bench", "t") == "http://127.0.0.1:8000/?token=t"
    assert link("0.0.0.0", 8000, "Bench", "t") == "http://bench:8000/?token=t"
    assert link("::1", 8000, "Bench", "t") == "http://[::1]:8000/?token=t"
    assert warning("127.0.0.1", "127.0.0.1", 8000) == warning("::1", "::1", 8000) == ""
    means = warning("0.0.0.0", "0.0.0.0", 8001)
    assert "not encrypted" in means
    assert "ssh -L 8001:127.0.0.1:8001" in means


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--port", "8000"], "--port is where --serve listens: give --serve too"),
        (["--host", "127.0.0.1"], "--host is where --serve listens: give --serve too"),
        (["--serve", "--headless"], "give one of them"),
        (["--serve", "--port", "70000"], "70000 is not in the range"),
        (["--serve", "nowhere"], "no run is going on in nowhere"),
    ],
)
def test_options_that_do_not_go_together(capsys, words, why):
    assert main(["console", *words]) == 2
    assert why in capsys.readouterr().err


def test_a_port_that_is_taken_in_one_sentence(tmp_path, capsys):
    file = register(Run(os.getpid(), "socket", str(tmp_path), "campaign", "bench"))
    try:
        with listen("127.0.0.1", 0) as listener:
            port = listener.getsockname()[1]
            assert main(["console", str(tmp_path), "--serve", "--port", str(port)]) == 2
        assert capsys.readouterr().err.startswith(f"rig: --port {port}: another program listens there already")
        assert main(["console", str(tmp_path), "--serve", "--host", "bench"]) == 2
        assert capsys.readouterr().err.startswith("rig: --host bench: an IP address of this machine was expected")
    finally:
        file.unlink()


def test_without_the_extra_one_sentence_says_what_to_install():
    code = "import sys; sys.modules['textual_serve'] = None; from rig.cli import entry; entry()"
    done = run([sys.executable, "-c", code, "console", "--serve"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == (
        "rig: --serve needs textual-serve, which is not installed here: pip install 'thruster-rig[serve]'\n"
    )
