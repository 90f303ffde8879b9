"""A campaign's page: all of its sections in their order."""

from __future__ import annotations

from collections.abc import Sequence

from rig.campaign_report.answers import Told
from rig.campaign_report.folder import Campaign
from rig.campaign_report.record import (
    calibration_section,
    configuration_section,
    environment_section,
    notes_section,
    signature_section,
    versions_section,
)
from rig.campaign_report.results import course_section, lead, results_section
from rig.campaign_report.thruster import thruster_section
from rig.fit.comparison import Changed
from rig.fit.report.comparisons import change_sections
from rig.report.page import Page, Remark, Section, sentences

NO_EARLIER = (
    "No earlier campaign with these thrusters was found in the same output folder; `rig report --earlier FOLDER` "
    "compares with any other."
)


def campaign_page(
    campaign: Campaign, told: Sequence[Told], changes: Sequence[Changed] = (), faults: Sequence[str] = ()
) -> Page:
    """`changes`: each earlier campaign against this one; `faults`: why one could not be compared, sentences."""
    sections = (
        results_section(told),
        course_section(campaign),
        *(thruster_section(each, campaign.folder.name) for each in told),
        earlier_section(changes, faults),
        environment_section(campaign),
        notes_section(campaign),
        calibration_section(campaign),
        configuration_section(campaign),
        versions_section(campaign),
        signature_section(),
    )
    day = min((r.created[:10] for r in campaign.recordings if r.created), default="")
    return Page(f"Campaign {campaign.name}{', ' if day else ''}{day}", lead(campaign, told), sections, contents=True)


def earlier_section(changes: Sequence[Changed], faults: Sequence[str]) -> Section:
    """Has a thruster changed since the campaigns before."""
    said = [Remark(f"{text}.", "doubt") for text in faults]
    if not changes:
        said.insert(0, Remark(NO_EARLIER))
    return Section("Earlier campaigns", (*sentences(said), *change_sections(changes)))
