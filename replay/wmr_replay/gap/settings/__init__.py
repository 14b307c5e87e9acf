"""Every threshold, prior and iteration budget of the gap analysis, each with its reason.

The reason names the source of a value: *statistics* (a level, a quantile, a known distribution), *physics*
(what a robot or a sensor can do), *numerics* (where an iteration stops), *presentation*, a *judgement*, or
the *patrol benchmark*: chosen on the simulator's patrol drives, seeds 700000 and following. Values of the
last two kinds suit those drives and their small robots (20 to 50 kg); they are to be measured again.
"""

from dataclasses import dataclass, field

from wmr_replay.gap.settings.evidence import (
    AnswerSettings,
    ChannelSettings,
    ExcitationSettings,
    HoldOutSettings,
    PlaceboSettings,
    SignificanceSettings,
)
from wmr_replay.gap.settings.filter import (
    BudgetSettings,
    CalibrationSettings,
    DiffusionSettings,
    FilterSettings,
    FormSettings,
    RefitSettings,
    SideslipSettings,
    StickingSettings,
    SwingSettings,
)
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_replay.gap.settings.log import BinSettings, SplitSettings, TorqueSettings, WindowSettings
from wmr_replay.gap.settings.result import (
    DetectableSettings,
    LocateSettings,
    ReportSettings,
    ShownSettings,
)
from wmr_replay.gap.settings.scan import MisfitSettings, ScanSettings
from wmr_replay.gap.settings.search import (
    BegunSettings,
    CandidateFitSettings,
    ModeSettings,
    SelectionSettings,
    SlipSettings,
    UnlabelledSettings,
    WorkSettings,
)
from wmr_replay.gap.settings.wheel_speed import WheelSpeedSettings


@dataclass(frozen=True)
class GateSettings:
    """All settings by the part of the analysis that reads them; ``GapOptions.gates`` carries them."""

    bins: BinSettings = field(default_factory=BinSettings)
    torque: TorqueSettings = field(default_factory=TorqueSettings)
    split: SplitSettings = field(default_factory=SplitSettings)
    windows: WindowSettings = field(default_factory=WindowSettings)
    filter: FilterSettings = field(default_factory=FilterSettings)
    diffusion: DiffusionSettings = field(default_factory=DiffusionSettings)
    swing: SwingSettings = field(default_factory=SwingSettings)
    refit: RefitSettings = field(default_factory=RefitSettings)
    forms: FormSettings = field(default_factory=FormSettings)
    budget: BudgetSettings = field(default_factory=BudgetSettings)
    calibration: CalibrationSettings = field(default_factory=CalibrationSettings)
    sticking: StickingSettings = field(default_factory=StickingSettings)
    sideslip: SideslipSettings = field(default_factory=SideslipSettings)
    scan: ScanSettings = field(default_factory=ScanSettings)
    misfit: MisfitSettings = field(default_factory=MisfitSettings)
    candidates: CandidateFitSettings = field(default_factory=CandidateFitSettings)
    selection: SelectionSettings = field(default_factory=SelectionSettings)
    modes: ModeSettings = field(default_factory=ModeSettings)
    begun: BegunSettings = field(default_factory=BegunSettings)
    work: WorkSettings = field(default_factory=WorkSettings)
    unlabelled: UnlabelledSettings = field(default_factory=UnlabelledSettings)
    slip: SlipSettings = field(default_factory=SlipSettings)
    significance: SignificanceSettings = field(default_factory=SignificanceSettings)
    hold_out: HoldOutSettings = field(default_factory=HoldOutSettings)
    placebo: PlaceboSettings = field(default_factory=PlaceboSettings)
    excitation: ExcitationSettings = field(default_factory=ExcitationSettings)
    answer: AnswerSettings = field(default_factory=AnswerSettings)
    channels: ChannelSettings = field(default_factory=ChannelSettings)
    detectable: DetectableSettings = field(default_factory=DetectableSettings)
    locate: LocateSettings = field(default_factory=LocateSettings)
    shown: ShownSettings = field(default_factory=ShownSettings)
    report: ReportSettings = field(default_factory=ReportSettings)
    formula: FormulaSettings = field(default_factory=FormulaSettings)
    wheel_speed: WheelSpeedSettings = field(default_factory=WheelSpeedSettings)
