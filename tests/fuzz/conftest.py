"""How long fuzzing takes: little and the same each time in `make test`; by chance and on and on in `make fuzz`."""

from hypothesis import HealthCheck, settings

_ALL = {"deadline": None, "suppress_health_check": list(HealthCheck)}
settings.register_profile("suite", max_examples=25, derandomize=True, database=None, **_ALL)
settings.register_profile("fuzz", max_examples=250, database=None, print_blob=True, **_ALL)
settings.load_profile("suite")
