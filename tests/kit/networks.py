"""The network that tests train: as small as one can be."""

from dafnet_addon.model.config import ModelConfig

TINY = ModelConfig(
    predictor_code=8,
    predictor_width=16,
    width=16,
    code=8,
    shared_encoder=True,
    mask=True,
    steps_upper=1,
    steps_lower=1,
)
