# From logs to graphs, maps and errors by make: what `nscan-cli nightly` does, with single commands.
#
#   make -j2 -f radish.mk DATA=. OUT=out
#
# Every log in DATA gives OUT/NAME.json, .png and .yaml, and where there is something to measure against,
# .errors.json: DATA/NAME.relations, or DATA/NAME.reference.tum, or the log itself for the names in
# TRUE_POSES. All are made again when what they are made from is newer. With MAX_TRANSLATION=0.05 (m) a
# larger error is a failure; with -k the other logs go on. Names must not contain spaces.
#
# Where to get the logs of Radish: `nscan-cli nightly radish --data FOLDER -o NIGHTS` with an empty FOLDER says.

NSCAN_CLI ?= nscan-cli
DATA ?= .
OUT ?= out
TRUE_POSES ?=
MAX_TRANSLATION ?=

NAMES := $(patsubst $(DATA)/%.log.gz,%,$(wildcard $(DATA)/*.log.gz))
RELATED := $(filter $(NAMES),$(patsubst $(DATA)/%.relations,%,$(wildcard $(DATA)/*.relations)))
REFERRED := $(filter $(NAMES),$(patsubst $(DATA)/%.reference.tum,%,$(wildcard $(DATA)/*.reference.tum)))
REFERRED := $(filter-out $(RELATED),$(REFERRED))
TRUE := $(filter-out $(RELATED) $(REFERRED),$(filter $(NAMES),$(TRUE_POSES)))
BOUND := $(if $(MAX_TRANSLATION),--max-translation $(MAX_TRANSLATION))

.PHONY: all graphs maps errors
# What a recipe that failed has begun would pass for new.
.DELETE_ON_ERROR:
all: graphs maps errors
graphs: $(NAMES:%=$(OUT)/%.json)
maps: $(NAMES:%=$(OUT)/%.png)
errors: $(patsubst %,$(OUT)/%.errors.json,$(RELATED) $(REFERRED) $(TRUE))

$(OUT):
	mkdir -p $@

$(NAMES:%=$(OUT)/%.json): $(OUT)/%.json: | $(OUT)
	$(NSCAN_CLI) slam -q $(DATA)/$*.log.gz -o $@ --depfile $(OUT)/$*.d

# The log is named, so that it need not be looked for; the YAML comes with the map.
$(NAMES:%=$(OUT)/%.png): $(OUT)/%.png: $(OUT)/%.json
	$(NSCAN_CLI) render -q $< $(DATA)/$*.log.gz -o $@

$(RELATED:%=$(OUT)/%.errors.json): $(OUT)/%.errors.json: $(OUT)/%.json $(DATA)/%.relations
	$(NSCAN_CLI) evaluate -q $< --relations $(DATA)/$*.relations --json $(BOUND) > $@

$(REFERRED:%=$(OUT)/%.errors.json): $(OUT)/%.errors.json: $(OUT)/%.json $(DATA)/%.reference.tum
	$(NSCAN_CLI) evaluate -q $< --reference $(DATA)/$*.reference.tum --json $(BOUND) > $@

$(TRUE:%=$(OUT)/%.errors.json): $(OUT)/%.errors.json: $(OUT)/%.json
	$(NSCAN_CLI) evaluate -q $< --reference $(DATA)/$*.log.gz --json $(BOUND) > $@

# What a graph is made from, slam has written down.
-include $(NAMES:%=$(OUT)/%.d)
