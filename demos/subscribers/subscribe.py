"""Print what `coneskin guard scene.toml --publish udp://127.0.0.1:9870` publishes."""

import json
import socket
import sys

receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
receiver.bind(("127.0.0.1", int(sys.argv[1]) if len(sys.argv) > 1 else 9870))
print("listening", receiver.getsockname()[1], flush=True)
name = ""
while name != "ending":
    event = json.loads(receiver.recv(65536))
    name = event["name"]
    print(f"{event['t']:.3f} {name}", flush=True)
