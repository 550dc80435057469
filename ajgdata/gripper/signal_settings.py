"""The signal chain as plain data: speaker, microphone, converter and noise."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from ajgdata.gripper.objects import Finite, Positive, SceneModel

#: A frequency in the band of the converter, whose sample rate is 44.1 kHz.
Frequency = Annotated[float, Field(gt=0, lt=22_050)]


class Motor(SceneModel):
    """The servo that holds the gripper at the grasp's angle; see `ajgdata.gripper.noise`."""

    level_db_spl: Finite = Field(
        60.0, description="rms at the microphone over all angles; estimate: a holding servo nearby"
    )
    fundamental_hz: Annotated[float, Field(gt=0, lt=2_000)] = Field(
        420.0, description="fundamental of the hum of the control loop; estimate"
    )
    harmonics: Annotated[int, Field(ge=1, le=10)] = Field(
        8, description="number of harmonics of the hum"
    )
    depth: Annotated[float, Field(ge=0, le=1)] = Field(
        0.8, description="relative change of each harmonic over a turn; 0: equal at all angles"
    )
    drift: Annotated[float, Field(ge=0, le=0.1)] = Field(
        0.005, description="largest relative deviation of the fundamental in a recording"
    )


class SignalChain(SceneModel):
    """Loudspeaker, microphone, converter and noise.

    The values of the microphone are from the data sheet of the paper's part (SPW2430). Level and
    response of the loudspeaker are those of a balanced-armature receiver.
    """

    level_db_spl: Finite | None = Field(
        90.0,
        description="rms of a full-scale sweep in the default gripper on a 20 mm cube (a receiver"
        " of 105 dB in 2 cm3 gives 89); null: the speaker is silent",
    )
    full_scale_db_spl: Finite = Field(
        129.0, description="level of a sine that just reaches full scale: the microphone's overload"
    )
    gain_db: Finite = Field(0.0, description="gain of the preamplifier, before the converter")
    noise_db_spl: Finite | None = Field(
        38.6,
        description="white noise of the microphone, 35 dB(A) up to 10 kHz; null: none. The noise of"
        " the room is `external_noise_dba`",
    )
    external_noise_dba: Finite | None = Field(
        None,
        description="level of white sound outside the gripper, which enters through the membrane;"
        " null: none (the paper's experiment: 45 to 80)",
    )
    motor: Motor | None = Field(
        None, description="sound of the servo that turned the gripper; null: the object was turned"
    )
    coupling_hz: Frequency = Field(
        100.0, description="cut-off of the AC coupling of speaker and microphone"
    )
    resonances_hz: tuple[Frequency, Frequency] = Field(
        (3_000.0, 8_500.0),
        description="resonances of the armature, and of the air in its case and spout",
    )
    resonances_q: tuple[Positive, Positive] = Field(
        (3.0, 3.0), description="quality factors of both resonances"
    )
