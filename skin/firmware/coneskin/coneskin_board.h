// Boards: which pin does what, how many bits the converter has, and the watchdog. One row for each board, and one for
// each converter that may stand in for the board's own.
//
// sense:     channels of the converter, one for each electrode A, B, C, D, on wires of their own
// current:   channel of the amplifier over the shunt;  supply: channel of the rail behind the shunt
// rail:      gates of the four analog switches from the rail to A, B, C, D; a high gate closes one
// ground:    gates of those from A, B, C, D to ground, likewise
// pull_down: pins at the far end of the resistors from C and D: low connects them
// select:    pins that address an analog multiplexer where the board has too few channels; all six are then channels
//            of the multiplexer, whose output is at the pin `common`
// Pins of I2C stay free: A4 and A5, on a Pico 4 and 5, on an ESP32 21 and 22; so do 10 to 13 of an Uno with an LTC1867.
// The tables are read by coneskin/skin/firmware/boards.py as well, for the wiring diagram: keep their form.
#pragma once
#include <Arduino.h>

// 0: the board's own converter. 1015 or 1115: two ADS1015 or ADS1115 on the board's I2C pins instead. 1867: one LTC1867
// on its SPI pins; it answers with 5 V.
#ifndef CONESKIN_CONVERTER
#define CONESKIN_CONVERTER 0
#endif

const uint8_t NONE = 255;

struct Board {
  const char *name;
  uint8_t bits;   // of the converter
  uint32_t baud;  // of the serial port; a port with USB of its own ignores it
  uint8_t sense[4], current, supply;
  uint8_t rail[4], ground[4], pull_down[2];
  uint8_t select[3], common;
};

#if defined(ARDUINO_ARCH_ESP32) && !CONESKIN_CONVERTER
#error "The ESP32's own converter is dead below 0.14 V and bent by per cents: set CONESKIN_CONVERTER to 1115."
#endif
#if CONESKIN_CONVERTER == 1867 && !defined(ARDUINO_AVR_UNO) && !defined(ARDUINO_AVR_NANO) && !defined(ARDUINO_AVR_NANO_EVERY)
#error "An LTC1867 answers with 5 V, which the pins of this board do not stand."
#endif

// clang-format off
#if defined(ARDUINO_AVR_UNO) || defined(ARDUINO_AVR_NANO)
const Board BOARD = {"uno", 10, 500000, {A0, A1, A2, A3}, A4, A5, {2, 3, 4, 5}, {6, 7, 8, 9}, {10, 11}, {NONE, NONE, NONE}, NONE};
#elif defined(ARDUINO_AVR_NANO_EVERY)
const Board BOARD = {"nano-every", 10, 500000, {A0, A1, A2, A3}, A6, A7, {2, 3, 4, 5}, {6, 7, 8, 9}, {10, 11}, {NONE, NONE, NONE}, NONE};
#elif defined(ARDUINO_ARCH_RP2040)
const Board BOARD = {"pico", 12, 921600, {0, 1, 2, 3}, 4, 5, {2, 3, 6, 7}, {8, 9, 10, 11}, {14, 15}, {16, 17, 18}, 26};
#elif defined(CORE_TEENSY)
const Board BOARD = {"teensy", 12, 921600, {A0, A1, A2, A3}, A4, A5, {2, 3, 4, 5}, {6, 7, 8, 9}, {10, 11}, {NONE, NONE, NONE}, NONE};
#elif defined(ARDUINO_ARCH_ESP32)
const Board BOARD = {"esp32", 12, 921600, {NONE, NONE, NONE, NONE}, NONE, NONE, {13, 4, 18, 19}, {32, 33, 23, 25}, {26, 27}, {NONE, NONE, NONE}, NONE};
#else
#error "This board has no row yet: add one above, with the pins that you wired and the bits of its converter."
#endif
// clang-format on

struct Converter {
  const char *name;
  uint8_t bits;
  uint16_t millivolts;  // of its highest count
  uint8_t sense[4], current, supply;
  uint16_t extra_bits, frame_length, rate_hz, supply_permille;  // usual settings with it
  bool slow;            // the self-test reads one electrode a frame, not four
  uint8_t pull_down[2];  // in place of the board's, where the converter is at those
};

// Channel n of an ADS1x15 is input n % 4 of the chip at address 0x48 + n / 4.
// clang-format off
#if CONESKIN_CONVERTER == 0
const Converter CONVERTER = {"built-in", BOARD.bits, 3300, {BOARD.sense[0], BOARD.sense[1], BOARD.sense[2], BOARD.sense[3]}, BOARD.current, BOARD.supply, 1, 52, 200, 758, false, {NONE, NONE}};
#elif CONESKIN_CONVERTER == 1015
const Converter CONVERTER = {"ads1015", 11, 4096, {0, 1, 2, 3}, 4, 5, 0, 40, 80, 610, true, {NONE, NONE}};
#elif CONESKIN_CONVERTER == 1115
const Converter CONVERTER = {"ads1115", 15, 4096, {0, 1, 2, 3}, 4, 5, 0, 40, 40, 610, true, {NONE, NONE}};
#elif CONESKIN_CONVERTER == 1867
const Converter CONVERTER = {"ltc1867", 16, 4096, {0, 1, 2, 3}, 4, 5, 0, 52, 200, 610, false, {A0, A1}};
#else
#error "CONESKIN_CONVERTER must be 0, 1015, 1115 or 1867."
#endif
// clang-format on

// A controller that hangs is reset within about 250 ms; its first frame then says RESTARTED.
#if defined(__AVR__)
#include <avr/wdt.h>
inline void watchdog_begin() { wdt_enable(WDTO_250MS); }
inline void watchdog_feed() { wdt_reset(); }
#elif defined(ARDUINO_ARCH_RP2040)
#include <hardware/watchdog.h>
inline void watchdog_begin() { watchdog_enable(250, true); }
inline void watchdog_feed() { watchdog_update(); }
#elif defined(ARDUINO_ARCH_ESP32)
#include <esp_task_wdt.h>
inline void watchdog_begin() {
#if ESP_IDF_VERSION_MAJOR >= 5
  esp_task_wdt_config_t settings = {};
  settings.timeout_ms = 250;
  settings.trigger_panic = true;
  if (esp_task_wdt_reconfigure(&settings) != ESP_OK) esp_task_wdt_init(&settings);
#else
  esp_task_wdt_init(1, true);  // whole seconds
#endif
  esp_task_wdt_add(NULL);
}
inline void watchdog_feed() { esp_task_wdt_reset(); }
#elif defined(__IMXRT1062__)  // Teensy 4: the first watchdog counts half seconds, so 1 stands for 1 s
inline void watchdog_begin() { WDOG1_WCR = WDOG_WCR_WT(1) | WDOG_WCR_WDE | WDOG_WCR_SRS | WDOG_WCR_WDA; }
inline void watchdog_feed() {
  WDOG1_WSR = 0x5555;
  WDOG1_WSR = 0xAAAA;
}
#else
#error "This board has no watchdog here: add it, or a controller that hangs stays silent until someone resets it."
#endif

bool converter_failed;  // since the last frame

#if CONESKIN_CONVERTER == 1867
#include <SPI.h>

const uint8_t SELECT_PIN = 10;  // CS/CONV: a conversion begins as it rises, and is read while it is low

inline void converter_begin() {
  digitalWrite(SELECT_PIN, HIGH);
  pinMode(SELECT_PIN, OUTPUT);
  SPI.begin();
  SPI.beginTransaction(SPISettings(8000000, MSBFIRST, SPI_MODE0));
}

// However fast the board: high for the 3.5 us that a conversion takes at most, low for the 16 bits (8 MHz of 40 allowed).
inline uint16_t ltc_transfer(uint16_t command) {
  delayMicroseconds(4);
  digitalWrite(SELECT_PIN, LOW);
  return SPI.transfer16(command);
}

// One conversion of a channel: 0 to 2^bits - 1. The word is SD OS S1 S0 COM UNI SLP: against ground, odd channels by OS,
// from 0 V. A chip that does not answer is found by the self-test and the supply.
inline uint16_t converter_read(uint8_t channel) {
  const uint16_t command = 0x8400 | uint16_t(channel & 1) << 14 | uint16_t(channel >> 1) << 12;
  ltc_transfer(command);
  delayMicroseconds(5);  // 1 kohm and 470 pF, from the channel before: 10 time constants
  digitalWrite(SELECT_PIN, HIGH);
  const uint16_t value = ltc_transfer(command);
  digitalWrite(SELECT_PIN, HIGH);
  return value;
}
#elif CONESKIN_CONVERTER
#include <Wire.h>

const uint16_t ADS_STARTS = 0x8000, ADS_DONE = 0x8000;  // the same bit, written and read
// One conversion, +-4.096 V, at the highest rate, no comparator.
const uint16_t ADS_CONFIG = ADS_STARTS | 4 << 12 | 1 << 9 | 1 << 8 | 7 << 5 | 3;
const uint16_t ADS_US = CONESKIN_CONVERTER == 1115 ? 1100 : 250;  // that a conversion takes at least
const uint16_t ADS_LONGEST_US = 3000;

inline void converter_begin() {
  Wire.begin();
  Wire.setClock(400000);
}

inline void ads_write(uint8_t address, uint16_t config) {
  Wire.beginTransmission(address);
  Wire.write(uint8_t(1));
  Wire.write(uint8_t(config >> 8));
  Wire.write(uint8_t(config & 0xFF));
  if (Wire.endTransmission()) converter_failed = true;
}

inline uint16_t ads_read(uint8_t address, uint8_t which) {
  Wire.beginTransmission(address);
  Wire.write(which);
  if (Wire.endTransmission() || Wire.requestFrom(address, uint8_t(2)) != 2) {
    converter_failed = true;
    return 0;
  }
  const uint16_t high = Wire.read();
  return high << 8 | Wire.read();
}

// One conversion of a channel: 0 to 2^bits - 1. A chip that does not answer leaves a mark in the frame's status.
inline uint16_t converter_read(uint8_t channel) {
  const uint8_t address = 0x48 + channel / 4;
  ads_write(address, ADS_CONFIG | uint16_t(channel % 4) << 12);
  const uint32_t begun = micros();
  delayMicroseconds(ADS_US);
  while (!converter_failed && !(ads_read(address, 1) & ADS_DONE))
    if (micros() - begun > ADS_LONGEST_US) converter_failed = true;
  if (converter_failed) return 0;
  const int16_t value = int16_t(ads_read(address, 0));
  return value < 0 ? 0 : value >> (15 - CONVERTER.bits);
}
#else
// The reference is the 3.3 V of the board, on every board: then the same supply of 2.5 V fits them all.
inline void converter_begin() {
#if defined(__AVR_ATmega328P__)
  analogReference(EXTERNAL);                         // a wire from 3.3 V to AREF
  ADCSRA = (ADCSRA & ~0x07) | 0x06;                  // 250 kHz: 52 us a reading, the quickest that still has 10 bits
#elif defined(ARDUINO_AVR_NANO_EVERY)
  analogReference(EXTERNAL);
#else
  analogReadResolution(BOARD.bits);
#endif
  for (uint8_t k = 0; k < 3; k++)
    if (BOARD.select[k] != NONE) pinMode(BOARD.select[k], OUTPUT);
}

// One conversion of a channel: 0 to 2^bits - 1.
inline uint16_t converter_read(uint8_t channel) {
  if (BOARD.common == NONE) return analogRead(channel);
  for (uint8_t k = 0; k < 3; k++) digitalWrite(BOARD.select[k], (channel >> k) & 1);
  delayMicroseconds(2);  // the multiplexer and the wire behind it
  return analogRead(BOARD.common);
}
#endif
