"""Channel of events by MQTT, with paho-mqtt: a broker hands them on, by a topic for each kind of event."""

from __future__ import annotations

import queue
import threading

from coneskin.core.errors import MissingExtra, SceneError

_ANSWER_TIMEOUT = 5.0  # s for the broker to answer
_CLOSE_TIMEOUT = 0.5  # s for the last events to leave


class MqttChannel:
    """A connection to a broker, made again where it is lost. An event's topic is ``topic`` and its name.

    Raises:
        SceneError: no broker answers, or it refuses.
        MissingExtra: paho-mqtt is not installed.
    """

    def __init__(self, host: str, port: int, topic: str, user: str | None = None, password: str | None = None) -> None:
        try:
            from paho.mqtt.client import Client
            from paho.mqtt.enums import CallbackAPIVersion
        except ModuleNotFoundError as exc:
            raise MissingExtra("paho-mqtt", "publishing by MQTT", "mqtt") from exc
        answers: queue.SimpleQueue[str] = queue.SimpleQueue()  # no callback holds this channel: no circle of references
        ended = self._ended = threading.Event()
        client = self._client = Client(CallbackAPIVersion.VERSION2)
        client.on_connect = lambda *said: answers.put(str(said[3]) if said[3].is_failure else "")
        client.on_disconnect = lambda *_: ended.set()
        client.reconnect_delay_set(1, 10)
        client.username_pw_set(user, password)
        client.connect_timeout = _ANSWER_TIMEOUT
        self._topic = topic
        try:
            client.connect(host, port)
            client.loop_start()
            refusal = answers.get(timeout=_ANSWER_TIMEOUT)
        except (OSError, queue.Empty) as exc:
            refusal = getattr(exc, "strerror", "") or str(exc) or "it does not answer"
        if refusal:
            self.close()
            why = f"no MQTT broker takes events at {host}:{port}: {refusal}; start one there, such as mosquitto"
            raise SceneError([why], "--publish")

    def send(self, name: str, data: bytes) -> None:
        """Hand a message to the thread of the connection.

        Raises:
            OSError: there is no connection.
        """
        if self._client.publish(f"{self._topic}/{name}", data).rc:
            raise OSError("not connected")

    def close(self) -> None:
        """Close the connection; may be called again."""
        self._ended.clear()
        if self._client.disconnect() or self._ended.wait(_CLOSE_TIMEOUT):
            self._client.loop_stop()
