"""The sketch for the boards that nothing here can run: it compiles against declarations of what their cores offer."""

import shutil
import subprocess

import pytest

from coneskin.skin.firmware.boards import boards, firmware_folder

CORE = """
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
enum { LOW, HIGH, INPUT, OUTPUT, EXTERNAL };
enum { A0 = 14, A1, A2, A3, A4, A5, A6, A7 };
#define F(text) text
void pinMode(uint8_t, uint8_t);
void digitalWrite(uint8_t, uint8_t);
int analogRead(uint8_t);
void analogReference(uint8_t);
void analogReadResolution(int);
void delayMicroseconds(unsigned int);
unsigned long micros();
struct Port {
  void begin(unsigned long);
  int available();
  int read();
  int availableForWrite();
  size_t write(const uint8_t *, size_t);
  size_t print(const char *);
  size_t print(char);
  size_t print(int);
  size_t println(const char *);
  size_t println();
};
extern Port Serial;
"""
MEMORY = """
#pragma once
struct Memory {
  void begin(size_t);
  bool commit();
  template <class T> T &get(int, T &value) { return value; }
  template <class T> const T &put(int, const T &value) { return value; }
};
extern Memory EEPROM;
"""
AVR_WATCHDOG = "enum { WDTO_250MS }; void wdt_enable(int); void wdt_reset();"
ESP_WATCHDOG = """
#define ESP_OK 0
struct esp_task_wdt_config_t { uint32_t timeout_ms, idle_core_mask; bool trigger_panic; };
int esp_task_wdt_init(%s);
int esp_task_wdt_reconfigure(const esp_task_wdt_config_t *);
int esp_task_wdt_add(void *);
int esp_task_wdt_reset();
"""
TEENSY = """
extern volatile uint16_t WDOG1_WCR, WDOG1_WSR;
#define WDOG_WCR_WT(n) ((n) << 8)
enum { WDOG_WCR_WDE = 4, WDOG_WCR_SRS = 16, WDOG_WCR_WDA = 32 };
"""
TARGETS = {  # what each core defines, and declares beside the rest
    "nano-every": ("-DARDUINO_AVR_NANO_EVERY -D__AVR__", "avr/wdt.h", AVR_WATCHDOG),
    "pico": (
        "-DARDUINO_ARCH_RP2040",
        "hardware/watchdog.h",
        "void watchdog_enable(uint32_t, bool); void watchdog_update();",
    ),
    "teensy": ("-DCORE_TEENSY -D__IMXRT1062__", "", TEENSY),
    "esp32": (
        "-DARDUINO_ARCH_ESP32 -DESP_IDF_VERSION_MAJOR=5",
        "esp_task_wdt.h",
        ESP_WATCHDOG % "const esp_task_wdt_config_t *",
    ),
    "esp32 of the older core": (
        "-DARDUINO_ARCH_ESP32 -DESP_IDF_VERSION_MAJOR=4",
        "esp_task_wdt.h",
        ESP_WATCHDOG % "uint32_t, bool",
    ),
}
needs_compiler = pytest.mark.skipif(shutil.which("g++") is None, reason="no g++: apt-get install g++")


WIRE = """
#pragma once
struct Bus {
  void begin();
  void setClock(uint32_t);
  void beginTransmission(uint8_t);
  size_t write(uint8_t);
  uint8_t endTransmission();
  uint8_t requestFrom(uint8_t, uint8_t);
  int read();
};
extern Bus Wire;
"""


def compile_for(folder, defines, header, declarations):
    (folder / "Arduino.h").write_text(CORE + (declarations if not header else ""), encoding="ascii")
    (folder / "Wire.h").write_text(WIRE, encoding="ascii")
    (folder / "EEPROM.h").write_text(MEMORY, encoding="ascii")
    if header:
        (folder / header).parent.mkdir(parents=True, exist_ok=True)
        (folder / header).write_text(declarations, encoding="ascii")
    sketch = firmware_folder() / "coneskin" / "coneskin.ino"
    words = ["g++", "-fsyntax-only", "-std=c++17", "-Wall", "-Wextra", "-Werror", *defines.split(), "-I", str(folder)]
    words += ["-include", "Arduino.h", "-x", "c++", str(sketch)]
    return subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)


@needs_compiler
@pytest.mark.parametrize(
    ("target", "ads"),
    [
        (name, ads)
        for n, name in enumerate(TARGETS)
        for ads in (0, (1015, 1115)[n % 2])
        if ads or not name.startswith("esp32")
    ],
)
def test_the_sketch_compiles_for_it(tmp_path, target, ads):
    defines, *rest = TARGETS[target]
    done = compile_for(tmp_path, f"{defines} -DCONESKIN_CONVERTER={ads}", *rest)
    assert done.returncode == 0, done.stderr


@needs_compiler
def test_the_own_converter_of_an_esp32_is_refused_by_the_compiler(tmp_path):
    defines, *rest = TARGETS["esp32"]
    assert "dead below 0.14 V" in compile_for(tmp_path, defines, *rest).stderr


@needs_compiler
def test_a_board_without_a_row_is_told_so_by_the_compiler(tmp_path):
    done = compile_for(tmp_path, "", "", "")
    assert done.returncode != 0
    assert "This board has no row yet" in done.stderr


def test_every_board_is_compiled_somewhere():
    assert {target.split()[0] for target in TARGETS} | {"uno"} == set(boards())
