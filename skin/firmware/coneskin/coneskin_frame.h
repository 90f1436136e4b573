/* Frames of the coneskin wire format, for any firmware: C99, no library, no memory of its own.

   The layout and its reasons are in docs/look-up/wire-format.md; the 50 frames of frame_vectors.csv, beside this folder, tell
   whether a copy or a translation of this file is right. A frame has 36 bytes, 40 (with the supply
   of each phase), or 52 (with the driven electrodes' own potentials as well). Everything is little endian but for the CRC. */
#ifndef CONESKIN_FRAME_H
#define CONESKIN_FRAME_H

#include <stddef.h>
#include <stdint.h>

#define CONESKIN_LONGEST_FRAME 52

/* Status bits. All but RESTARTED and TOUCH make the frame a fault, and so a stop. */
enum {
  CONESKIN_SUPPLY = 0x01,      /* the drive supply left its range */
  CONESKIN_ADC = 0x02,         /* a conversion failed */
  CONESKIN_OVERRUN = 0x04,     /* a phase did not get its time */
  CONESKIN_SELF_TEST = 0x08,   /* the self-test failed */
  CONESKIN_OVERCURRENT = 0x10, /* the drive current was limited */
  CONESKIN_RESTARTED = 0x20,   /* the first frame since the start */
  CONESKIN_TOUCH = 0x40        /* the device's own threshold is exceeded: information */
};

/* Counts of the converter in the order in which they are sent. */
enum {
  CONESKIN_TOUCH_C, CONESKIN_TOUCH_D, CONESKIN_TOUCH_CURRENT,
  CONESKIN_RADIAL_C, CONESKIN_RADIAL_D, CONESKIN_RADIAL_CURRENT,
  CONESKIN_ANGULAR_A, CONESKIN_ANGULAR_B, CONESKIN_ANGULAR_CURRENT,
  CONESKIN_TOUCH_SUPPLY,                           /* 36 bytes end here: one supply for all phases */
  CONESKIN_RADIAL_SUPPLY, CONESKIN_ANGULAR_SUPPLY, /* 40 bytes end here */
  CONESKIN_TOUCH_A, CONESKIN_TOUCH_B, CONESKIN_RADIAL_A, CONESKIN_RADIAL_B, CONESKIN_ANGULAR_C, CONESKIN_ANGULAR_D,
  CONESKIN_COUNTS
};

typedef struct {
  uint8_t length;    /* bytes of the frame: 36, 40 or 52 */
  uint16_t device;   /* which electronics */
  uint8_t sensor;    /* which of its sensors */
  uint8_t status;    /* bits of the first table */
  uint16_t sequence; /* one more for each frame of this sensor, also when a frame could not be sent */
  uint32_t clock_us; /* device clock at the end of the touch phase [us] */
  uint16_t counts[CONESKIN_COUNTS];
} ConeskinFrame;

/* CRC-16/XMODEM: polynomial 0x1021, start 0. Half a byte at a time: 32 bytes of table, as fits a small controller. */
static inline uint16_t coneskin_crc(const uint8_t *data, size_t length) {
  static const uint16_t table[16] = {0x0000, 0x1021, 0x2042, 0x3063, 0x4084, 0x50A5, 0x60C6, 0x70E7,
                                     0x8108, 0x9129, 0xA14A, 0xB16B, 0xC18C, 0xD1AD, 0xE1CE, 0xF1EF};
  uint16_t crc = 0;
  for (size_t i = 0; i < length; i++) {
    crc = (uint16_t)(table[(crc >> 12) ^ (data[i] >> 4)] ^ (crc << 4));
    crc = (uint16_t)(table[(crc >> 12) ^ (data[i] & 15)] ^ (crc << 4));
  }
  return crc;
}

static inline uint8_t *coneskin_put16(uint8_t *at, uint16_t value) {
  *at++ = (uint8_t)(value & 0xFF);
  *at++ = (uint8_t)(value >> 8);
  return at;
}

/* Write a frame into a buffer of CONESKIN_LONGEST_FRAME bytes; return how many there are. */
static inline size_t coneskin_encode(const ConeskinFrame *frame, uint8_t *out) {
  const uint8_t counts = (uint8_t)((frame->length - 16) / 2);
  uint8_t *at = out;
  *at++ = 0xC5;
  *at++ = 0x3A;
  *at++ = 1; /* version of the format */
  *at++ = frame->length;
  at = coneskin_put16(at, frame->device);
  *at++ = frame->sensor;
  *at++ = frame->status;
  at = coneskin_put16(at, frame->sequence);
  at = coneskin_put16(at, (uint16_t)(frame->clock_us & 0xFFFF));
  at = coneskin_put16(at, (uint16_t)(frame->clock_us >> 16));
  for (uint8_t k = 0; k < counts; k++) at = coneskin_put16(at, frame->counts[k]);
  const uint16_t crc = coneskin_crc(out, (size_t)(at - out));
  *at++ = (uint8_t)(crc >> 8); /* the CRC alone is sent high byte first: then the CRC over all bytes is 0 */
  *at++ = (uint8_t)(crc & 0xFF);
  return frame->length;
}

#endif
