// Print what `coneskin guard scene.toml --publish udp://127.0.0.1:9870` publishes: node subscribe.js 9870
const receiver = require("node:dgram").createSocket("udp4");
receiver.on("message", (data) => {
  const event = JSON.parse(data);
  console.log(event.t.toFixed(3), event.name);
  if (event.name === "ending") receiver.close();
});
receiver.bind(Number(process.argv[2] ?? 9870), "127.0.0.1", () => console.log("listening", receiver.address().port));
