// A HID device for a worker in place of `navigator.hid`: the browser's own needs a device that is plugged in. It speaks the protocol of
// `TYPODONT_FAKE`: an open handle (content/devices/open-handle.md), a SpaceMouse or a Polhem. The channel `hand` moves it and tells
// what it has received.

{
  const channel = new BroadcastChannel('hand');
  const told = { kind: TYPODONT_FAKE, opened: 0, received: 0, wrong: 0, position: [0, 20, 0], force: [0, 0, 0], speed: 0, most: 0, lit: false, current: 0 };
  let goal = [...told.position];
  let deflection = [0, 0, 0, 0, 0, 0];

  const checksum = bytes => ~bytes.reduce((sum, byte) => {
    sum ^= byte;
    for (let bit = 0; bit < 8; bit++) sum = sum & 1 ? sum >>> 1 ^ 0xedb88320 : sum >>> 1;
    return sum;
  }, ~0) >>> 0;
  const report = (bytes, fill) => {
    const view = new DataView(new ArrayBuffer(bytes));
    fill(view);
    return view;
  };
  const sealed = (kind, fill) => report(64, view => {
    [0x54, 0x48, 1, kind].forEach((byte, at) => view.setUint8(at, byte));
    fill(view);
    view.setUint32(60, checksum(new Uint8Array(view.buffer, 0, 60)), true);
  });

  /** A hand of 150 g, whose arm pulls it to the goal with 0.15 N/mm. */
  let speed = [0, 0, 0];
  const move = seconds => {
    for (let step = 0; step < Math.round(seconds * 1000); step++) {
      told.position.forEach((mm, axis) => {
        const pull = Math.max(-2, Math.min(2, 0.15 * (goal[axis] - mm)));
        speed[axis] += (pull + told.force[axis] - 0.005 * speed[axis]) / 1.5e-4 * 0.001;
        told.position[axis] += speed[axis] * 0.001;
      });
    }
    told.speed = Math.hypot(...speed);
  };

  const kinds = {
    'open-handle': {
      ids: { vendorId: 0x16c0, productId: 0x0486, productName: 'Typodont Handle', collections: [{ usagePage: 0xffab, usage: 0x0200 }] },
      number: 0,
      obeyed: 0,
      livesUntil: 0,
      receive(id, view) {
        const bytes = new Uint8Array(view.buffer, view.byteOffset, view.byteLength);
        const isWhole = id === 0 && bytes.length === 64 && bytes[0] === 0x54 && bytes[1] === 0x4f && bytes[2] === 1
          && view.getUint32(60, true) === checksum(bytes.subarray(0, 60));
        if (!isWhole) return told.wrong++;
        if (bytes[3] === 2) {
          // 5 N, 1.5 N, no torque, 1.5 N/mm, 5 N·s/m, 0.02 mm, 60 45 30 mm, 60 g.
          return this.send(0, sealed(2, spec => {
            [5000, 1500, 0, 1500, 500, 200, 600, 450, 300, 60].forEach((value, at) => spec.setUint16(6 + 2 * at, value, true));
            spec.setUint8(26, 1);
            [...'School handle'].forEach((letter, at) => spec.setUint8(28 + at, letter.charCodeAt()));
          }));
        }
        this.obeyed = view.getUint16(4, true);
        told.force = [8, 12, 16].map(at => view.getFloat32(at, true));
        told.most = Math.max(told.most, Math.hypot(...told.force));
        const life = view.getUint16(32, true);
        if (!(life > 0 && life <= 20)) told.wrong++;
        this.livesUntil = performance.now() + life;
      },
      turn(seconds) {
        if (performance.now() > this.livesUntil) told.force = [0, 0, 0];
        move(seconds);
        this.number = this.number + 1 & 0xffff;
        this.send(0, sealed(1, view => {
          view.setUint16(4, this.number, true);
          view.setUint16(6, this.obeyed, true);
          view.setUint8(8, 3);
          told.position.forEach((mm, axis) => view.setInt32(16 + 4 * axis, Math.round(mm / 0.02) * 200, true));
        }));
      },
    },
    spacemouse: {
      ids: { vendorId: 0x256f, productId: 0xc635, productName: 'SpaceMouse Compact', collections: [{ usagePage: 1, usage: 8 }] },
      receive(id, view) {
        if (id !== 4 || view.byteLength !== 1) told.wrong++;
        told.lit = view.getUint8(0) === 1;
      },
      // It tells of a change only.
      turn() {
        if (String(deflection) === this.last) return;
        this.last = String(deflection);
        this.send(1, report(12, view => deflection.forEach((count, axis) => view.setInt16(2 * axis, count, true))));
      },
    },
    polhem: {
      ids: { vendorId: 0x16c0, productId: 0x0486, productName: 'Teensyduino RawHID', collections: [{ usagePage: 0xffab, usage: 0x0200 }] },
      receive(id, view) {
        if (id !== 0 || view.byteLength !== 64) told.wrong++;
        for (const at of [0, 2, 4]) told.current = Math.max(told.current, Math.abs(view.getInt16(at, true)));
        this.isAsked = true;
      },
      // It answers what it receives.
      turn() {
        if (!this.isAsked) return;
        this.isAsked = false;
        this.send(0, report(64, view => deflection.slice(0, 3).forEach((count, at) => view.setInt16(2 * at, count, true))));
      },
    },
  };

  const hid = new EventTarget();
  let plugged;
  const plug = () => {
    const kind = Object.create(kinds[told.kind]);
    const device = {
      ...kind.ids, opened: false, oninputreport: null,
      open: async () => { device.opened = true; told.opened++; },
      close: async () => { device.opened = false; },
      sendReport: async (id, bytes) => {
        if (!device.opened || device !== plugged) throw new Error('the device is not open');
        told.received++;
        setTimeout(() => kind.receive(id, new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength)));
      },
    };
    kind.send = (reportId, data) => device.opened && device === plugged && device.oninputreport?.({ device, reportId, data });
    let last = performance.now();
    const timer = setInterval(() => {
      if (device !== plugged) return clearInterval(timer);
      const now = performance.now();
      kind.turn(Math.min(0.02, (now - last) / 1000));
      last = now;
    }, 4);
    plugged = device;
  };
  hid.getDevices = async () => plugged ? [plugged] : [];
  plug();
  Object.defineProperty(navigator, 'hid', { value: hid });

  channel.onmessage = ({ data }) => {
    if (data.goal) goal = data.goal;
    if (data.deflection) deflection = data.deflection;
    if (data.unplug) {
      const device = plugged;
      plugged = undefined;
      hid.dispatchEvent(Object.assign(new Event('disconnect'), { device }));
    }
    // A browser that has forgotten the permission and is given it again tells nobody.
    if (data.plug) plug();
  };
  setInterval(() => channel.postMessage({ told }), 20);
}
