# Klingel: one entry to everything. `make` alone prints the targets.
CC      ?= gcc
ifeq ($(origin CC),default)
CC      := gcc
endif
OPT     ?= -O3
BUILD   ?= build
PYTHON  ?= /usr/bin/python3
REAL    ?=

WARN     = -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef -Wvla -Werror
# Strict arithmetic: the same bits from every compiler and level. -fno-math-errno only lets sqrt be one instruction.
# -fno-trapping-math says that nobody looks at the floating-point exceptions. Neither changes a result.
STRICT   = -std=c11 -ffp-contract=off -fno-fast-math -fno-math-errno -fno-trapping-math
# What is built runs where it is built, and newer x86-64 processors have more registers and instructions. `make MACHINE=` is
# for any x86-64. The bits are the same; without FMA, because gcc 12 makes one of a sum beside a difference even where
# -ffp-contract=off forbids it.
ifneq ($(filter gcc gcc-% clang clang-%,$(notdir $(CC))),)
MACHINE ?= $(if $(shell /lib64/ld-linux-x86-64.so.2 --help 2>/dev/null | grep 'x86-64-v3 .supported'),-march=x86-64-v3 -mno-fma)
MACHINE := $(MACHINE)
endif
# A step goes through many small functions of several files; gcc puts them together when the command is linked. The
# objects are ordinary ones as well, so that everything else links in no time.
ifneq ($(filter gcc gcc-%,$(notdir $(CC))),)
FAT     ?= -flto -ffat-lto-objects
TOGETHER ?= -flto=auto
endif
COREFLAGS = $(STRICT) $(OPT) $(MACHINE) $(FAT) -g $(WARN) -ffreestanding $(REAL) -Icore
PORTFLAGS = $(STRICT) $(OPT) $(MACHINE) -g $(WARN) -ffreestanding $(REAL) -Icore -Iport
HOSTFLAGS = $(STRICT) $(OPT) $(MACHINE) -g $(WARN) $(REAL) -D_GNU_SOURCE -Icore -Iport -Ihal_linux -Itools/klingel
# tests are linked of the ordinary objects
TESTFLAGS = $(HOSTFLAGS) -fno-lto -Itests
CLI_LIBS  = -lcyaml -lyaml -llapacke -lm -lpthread

CORE_SRC := $(wildcard core/*.c)
PORT_SRC := $(wildcard port/*.c)
HAL_SRC  := $(wildcard hal_linux/*.c)
CLI_SRC  := $(wildcard tools/klingel/*.c)
CORE_OBJ := $(CORE_SRC:%.c=$(BUILD)/%.o)
PORT_OBJ := $(PORT_SRC:%.c=$(BUILD)/%.o)
HAL_OBJ  := $(HAL_SRC:%.c=$(BUILD)/%.o)
CLI_OBJ  := $(CLI_SRC:%.c=$(BUILD)/%.o)
# everything of the command but its main(), for tests
CLI_TESTABLE := $(filter-out $(BUILD)/tools/klingel/main.o,$(CLI_OBJ))
TEST_SRC := $(wildcard tests/core/test_*.c tests/port/test_*.c tests/hal_linux/test_*.c tests/tools/test_*.c)
TEST_BIN := $(TEST_SRC:%.c=$(BUILD)/%)
LIBS      = $(BUILD)/libklingel_linux.a $(BUILD)/libklingel_port.a $(BUILD)/libklingel_core.a

.PHONY: help deps all lib test-programs check test demo golden-all footprint sketches format clean
help:
	@echo 'make demo    build, run the two-axle wagon on a CAN bus for 30 s, show its states, draw a picture'
	@echo 'make test    everything that is tested (what CI runs)'
	@echo 'make check   the fast tests, below 2 minutes'
	@echo 'make all     build the libraries and build/klingel'
	@echo 'make lib     build the libraries alone (no dependency at all)'
	@echo 'make deps    install the Debian packages that building and testing need'
	@echo 'make firmware       the wagon as bare-metal firmware for a Cortex-M7'
	@echo 'make firmware-demo  runs it in QEMU, with python-can (slcan) at its UART'
	@echo 'make golden-all     the same bits from every compiler, level and target (minutes)'
	@echo 'make footprint      code, tables, state, stack and instructions per target'
	@echo 'make sketches   draws the vehicles of models/ again'
	@echo 'make format  let clang-format put the sources in order'
	@echo 'make clean   remove build/'

deps:
	@sh tools/deps.sh

all: lib $(BUILD)/klingel
lib: $(LIBS)

$(BUILD)/libklingel_core.a: $(CORE_OBJ)
$(BUILD)/libklingel_port.a: $(PORT_OBJ)
$(BUILD)/libklingel_linux.a: $(HAL_OBJ)
%.a:
	@mkdir -p $(@D)
	@rm -f $@
	ar rcsD $@ $^

$(BUILD)/core/%.o: core/%.c
	@mkdir -p $(@D)
	$(CC) $(COREFLAGS) -MMD -MP -c $< -o $@
$(BUILD)/port/%.o: port/%.c
	@mkdir -p $(@D)
	$(CC) $(PORTFLAGS) -MMD -MP -c $< -o $@
$(BUILD)/hal_linux/%.o: hal_linux/%.c
	@mkdir -p $(@D)
	$(CC) $(HOSTFLAGS) -MMD -MP -c $< -o $@
$(BUILD)/tools/%.o: tools/%.c
	@mkdir -p $(@D)
	$(CC) $(HOSTFLAGS) -MMD -MP -c $< -o $@

$(BUILD)/klingel: $(CLI_OBJ) $(LIBS)
	$(CC) $(OPT) $(TOGETHER) -g -o $@ $(CLI_OBJ) $(LIBS) $(CLI_LIBS)

# tests/<room>/test_x.c is one cmocka program; tests/tools ones also see the command's objects
$(BUILD)/tests/tools/%: tests/tools/%.c $(CLI_TESTABLE) $(LIBS)
	@mkdir -p $(@D)
	$(CC) $(TESTFLAGS) -MMD -MP -o $@ $< $(CLI_TESTABLE) $(LIBS) -lcmocka $(CLI_LIBS)
$(BUILD)/tests/%: tests/%.c $(LIBS)
	@mkdir -p $(@D)
	$(CC) $(TESTFLAGS) -MMD -MP -o $@ $< $(LIBS) -lcmocka -lm -lpthread

include tests/conformance/Makefile.inc
include port/mps2/Makefile.inc

test-programs: all $(TEST_BIN) $(CONFORMANCE) $(BUILD)/tests/hal_linux/stream_socketcand

# deps comes first and by itself: nothing can be built before it
check:
	@$(MAKE) --no-print-directory deps
	@$(MAKE) --no-print-directory test-programs
	@$(PYTHON) tests/run.py --build $(BUILD)
test:
	@$(MAKE) --no-print-directory deps
	@$(MAKE) --no-print-directory -j2 test-programs $(FW_ELF) $(FW_TWIN)
	@$(PYTHON) tests/run.py --build $(BUILD) --all
demo:
	@$(MAKE) --no-print-directory deps
	@$(MAKE) --no-print-directory -j2 all
	@KLINGEL=$(BUILD)/klingel sh tools/demo.sh

golden-all:
	@$(MAKE) --no-print-directory deps
	@$(PYTHON) tests/golden/golden.py --all --build $(BUILD)/golden
footprint:
	@$(MAKE) --no-print-directory deps
	@$(MAKE) --no-print-directory -j2 $(BUILD)/klingel
	@$(PYTHON) tools/footprint.py --build $(BUILD)

# what models/README.md shows; tests/tools/test_sketch.py says when it is due
VEHICLES = $(shell grep -lE '^(wheelsets|vehicles):' models/*.yaml)
sketches: $(BUILD)/klingel
	@mkdir -p models/sketches
	@for m in $(VEHICLES); do $(BUILD)/klingel sketch $$m -o models/sketches/$$(basename $$m .yaml).png || exit 1; done
format:
	clang-format -i $$(git ls-files '*.c' '*.h')
clean:
	rm -rf $(BUILD)

-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)
