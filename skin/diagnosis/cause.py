"""Causes of a stream that a guard would not accept, each with what to do about it."""

from __future__ import annotations

from enum import Enum, unique

from coneskin.core.finding import Finding


@unique
class Cause(Enum):
    """A reason why bytes are no good frames; the value says what to do, for people."""

    NONE = "nothing to do"
    # nothing, or nothing any more
    SILENT = "check power, cable and port (`coneskin find-port`), and whether the firmware sends at all"
    STOPPED = "the device has stopped sending: look for a loop that hangs, a reset, or a cable that moved"
    FEW_BYTES = "wait, or check that the firmware sends frames without being asked"
    # the line
    BAUD = "set the baud rate of the port and of the firmware to the same value"
    BREAK = "only zeros come: check the baud rate, and that the line is not held low (TX and ground exchanged)"
    IDLE_NOISE = "the same byte over and over is no data: check the pin, the ground wire and the baud rate"
    INVERTED = "the line is inverted: take out an inverter or RS-232 driver, or invert TX in the UART's settings"
    BIT_ORDER = "send the least significant bit of each byte first, as every UART does"
    NIBBLES_SWAPPED = "the halves of each byte are exchanged: correct the order of the four-bit groups"
    SEVEN_BITS = "use 8 data bits and no parity at both ends"
    NEWLINES = "a line feed inside a frame has become CR LF: write the bytes in binary mode, not as text"
    FLOW_CONTROL = "switch software flow control (XON/XOFF) off at both ends: it swallows the bytes 0x11 and 0x13"
    ZEROS_LOST = "the byte 0x00 is missing: write with a length, not as a string that ends at the first zero"
    BYTES_LOST = "single bytes are missing: check flow control, buffer sizes, interrupts and the cable"
    EXTRA_BYTES = "send nothing between the frames: no line end, no separator"
    DAMAGED = "check cable and ground, and that nothing changes the buffer while it is being sent"
    # no frames, but something known
    TEXT = "send frames in binary as docs/look-up/wire-format.md has them; move prints to another port"
    HEX_TEXT = "send the bytes themselves, not their hexadecimal digits"
    BASE64 = "send the bytes themselves, not base64"
    SLIP = "send the bare frames: no SLIP around them"
    COBS = "send the bare frames: no COBS around them"
    NMEA = "this is a satellite receiver or another NMEA device: choose another port"
    MAVLINK = "this is MAVLink, an autopilot: choose another port"
    MODBUS = "this is Modbus RTU: choose another port, or send frames as docs/look-up/wire-format.md has them"
    UBX = "this is a u-blox receiver: choose another port"
    # the frame
    SYNC_SWAPPED = "send the sync bytes in the order C5 3A: written as one 16-bit number it is 0x3AC5"
    WORDS_SWAPPED = "send each 16-bit word with its low byte first"
    SYNC_OTHER = "begin each frame with C5 3A"
    VERSION = "set byte 2, the version, to 1, or update coneskin if the firmware is newer"
    HEADER_SWAPPED = "byte 2 is the version and byte 3 the length: exchange them"
    LENGTH_BYTE = "byte 3 counts the whole frame, sync and CRC included"
    FRAME_SIZE = "compare the fields with the table in docs/look-up/wire-format.md, one by one"
    PADDING = "declare the struct packed (`__attribute__((packed))`), or write the fields one after the other"
    CRC_MISSING = "append the CRC-16/XMODEM of the bytes before it, high byte first"
    CUT_AT_BUFFER = "the sender's buffer ends there: enlarge it, or write the frame in two pieces"
    BIG_ENDIAN = "send every number with its low byte first; only the CRC goes high byte first"
    # the checksum
    CRC_BYTE_ORDER = "append the CRC with its high byte first"
    CRC_START = "start the CRC-16 (polynomial 0x1021) with 0"
    CRC_REFLECTED = "use CRC-16/XMODEM: polynomial 0x1021, start 0, bits not reflected, nothing added at the end"
    CRC_POLYNOMIAL = "use CRC-16/XMODEM: polynomial 0x1021, start 0"
    CRC_RANGE = "take the CRC over every byte before it, the sync bytes included, and nothing else"
    CRC_CONSTANT = "write the CRC into the frame before it is sent"
    CRC_STALE = "take the CRC last, when every other byte of this frame is in place"
    CHECKSUM_KIND = "replace the sum by CRC-16/XMODEM: polynomial 0x1021, start 0, high byte first"
    CRC_UNKNOWN = "compare your CRC with the example in docs/look-up/wire-format.md"
    # numbers of the frame
    SEQUENCE_STANDS = "count the sequence up by one for each frame of the sensor"
    SEQUENCE_8_BIT = "the sequence is a 16-bit number: count on to 65535"
    SEQUENCE_SHARED = "each sensor has a sequence of its own: count the frames of this sensor only"
    SEQUENCE_STEPS = "count the sequence up by one for each frame of the sensor; or frames are lost on the way"
    SEQUENCE_RANDOM = "the sequence is a number of its own that counts frames: see that nothing else is written there"
    FRAMES_LOST = "check baud rate and cable, send fewer frames a second"
    UNCOUNTED = "count a frame in the sequence also when it is not sent, and measure in even steps"
    REPEATED = "send each measurement once: sequence and clock of a frame must be new"
    CLOCK_STANDS = "put the device's time [us] into the clock of each frame"
    CLOCK_MILLISECONDS = "the clock counts microseconds: use micros(), not millis()"
    CLOCK_SECONDS = "the clock counts microseconds: use micros()"
    CLOCK_NANOSECONDS = "the clock counts microseconds: divide by 1000"
    CLOCK_RATIO = "correct the device's clock: its crystal and prescaler, or the ticks of its timer for a microsecond"
    HELD_UP = "end what else this computer does, or send fewer frames a second, and look again; the board may be right"
    CLOCK_16_BIT = "the clock has 32 bits: extend the 16-bit timer in software"
    CLOCK_JUMPS = "the clock must run evenly: take the time at the end of each frame's touch phase"
    RATE_LOW = "send 200 to 1000 frames a second of each sensor, as the baud rate allows; or raise skin_silence_ms"
    HELD_BACK = "set the latency timer of the USB adapter to 1 ms, and send each frame as soon as it is complete"
    STATUS = "see the device's own report: the status bits are in docs/look-up/wire-format.md"
    STATUS_RESERVED = "bit 0x80 of the status must be 0"
    RESTARTED_ALWAYS = "set RESTARTED (0x20) in the first frame after a start only"
    RESTARTS = "the device starts again and again: check its supply, its watchdog and its stack"
    UNKNOWN_SENSOR = "correct device_id and sensor_id in the scene or the numbers in the firmware"
    # measurements
    COUNTS_STUCK = "read the converter anew for each frame, and see whether it has started at all"
    NO_NOISE = "a reading that never changes would hide an open wire: read it anew for each frame (the guard: STUCK)"
    SATURATED = "every reading stands at full scale: check the converter's reference and its channel"
    SHORT = "part what touches, at tabs, connector and solder; what stays with the sensor unplugged is the board's"
    SUPPLY_ZERO = "measure the drive supply and put its counts into the frame"
    CURRENTS_ZERO = "measure the drive current of each phase over the shunt and put its counts into the frame"
    RADIAL_CURRENT_ZERO = "measure the current of the radial phase (B at the supply, A at ground); or a wire is open"
    ANGULAR_CURRENT_ZERO = "measure the current of the angular phase (C at the supply, D at ground); or a wire is open"
    LEFT_JUSTIFIED = "send the converter's counts as they are, not shifted up to 16 bits"
    SCALED = "send the converter's counts as they are, not scaled to 16 bits; or set adc_bits in the scene"
    NEGATIVE = "counts are unsigned: use a converter's single-ended input, or hold small readings at 0"
    CONVERTER_BITS = "set adc_bits in the scene to the converter's resolution, or set the converter's"
    MILLIVOLTS = "send the converter's counts, not millivolts"
    FIELD_ORDER = "put the fields in the order of the table in docs/look-up/wire-format.md"
    PHASES_EXCHANGED = "the radial phase drives B and A, the angular one C and D: exchange them"
    SUPPLY_OFF = "check the supply, the reference of the converter, and supply_v and adc_v of the scene"
    CURRENT_OFF = "check shunt and amplifier, and current_full_scale_ma and the sheets' resistance in the scene"
    GUIDES_FLOAT = "give every input a resistor to ground (10 Mohm) (untouched guides then read 0); shield wires"
    UNKNOWN = "look at the bytes with --hex; most often it is the baud rate"

    @property
    def key(self) -> str:
        """Name of the cause for programs, and ``item`` of its finding."""
        return self.name.lower()

    def found(self, what: str) -> Finding:
        """Return the finding of this cause, with what was seen in plain words."""
        return Finding(self.key, "ok", what) if self is Cause.NONE else Finding(self.key, "bad", what, "", self.value)
