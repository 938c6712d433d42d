'use strict';
/* global THREE, SCENE */
(() => {
  const TARGET = new THREE.Color('#1f6fb4'), SOURCE = new THREE.Color('#d1495b');
  const view = document.getElementById('view');
  const floats = text => {
    const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  };

  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ canvas: view.querySelector('canvas'), antialias: false });
  } catch (error) {
    document.body.classList.add('flat'); // the pictures are shown instead
    return;
  }
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  renderer.setClearColor('#10151b');
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(50, 1, 0.01, 1e6);
  camera.up.set(0, 0, 1);

  const material = options => new THREE.PointsMaterial({ size: 2, sizeAttenuation: false, ...options });
  const cloud = (positions, options) => {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    return new THREE.Points(geometry, material(options));
  };
  const poses = SCENE.poses.map(values => new THREE.Matrix4().fromArray(values));
  const target = cloud(floats(SCENE.target), { color: TARGET });
  const source = cloud(floats(SCENE.source), { color: SOURCE, size: 3 });
  source.matrixAutoUpdate = false;

  // q_i: dark blue where the clouds agree, through white to red where they do not
  const q = floats(SCENE.q), colours = new Float32Array(3 * q.length), ramp = new THREE.Color();
  const highest = [...q].sort((a, b) => a - b)[Math.floor(0.98 * (q.length - 1))] || 1;
  const [low, middle, high] = ['#2b5fa8', '#f2f2f2', '#c8102e'].map(c => new THREE.Color(c));
  q.forEach((value, i) => {
    const share = Math.max(0, Math.min(1, value / highest));
    if (share < 0.5) ramp.lerpColors(low, middle, 2 * share);
    else ramp.lerpColors(middle, high, 2 * share - 1);
    ramp.toArray(colours, 3 * i);
  });
  const means = cloud(floats(SCENE.means), { vertexColors: true, size: 4 });
  means.geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));

  // what nothing determines: a line along a translation, a ring about a turn, at the sensor
  const free = SCENE.free.map(motion => {
    const [move, turn] = [new THREE.Vector3(...motion.slice(0, 3)), new THREE.Vector3(...motion.slice(3))];
    const points = [], size = 0.15 * SCENE.extent;
    if (move.length() * SCENE.extent > turn.length() * SCENE.extent ** 2 || turn.length() === 0) {
      move.normalize().multiplyScalar(size);
      points.push(move.clone().negate(), move);
    } else {
      turn.normalize();
      const across = new THREE.Vector3(Math.abs(turn.z) < 0.9 ? 0 : 1, 0, Math.abs(turn.z) < 0.9 ? 1 : 0).cross(turn).setLength(size);
      for (let k = 0; k < 48; k++)
        for (const step of [k, k + 1])
          points.push(across.clone().applyAxisAngle(turn, step * Math.PI / 24));
    }
    const line = new THREE.LineSegments(
      new THREE.BufferGeometry().setFromPoints(points),
      new THREE.LineBasicMaterial({ color: '#ffc61a' }));
    line.position.setFromMatrixPosition(poses[poses.length - 1]);
    return line;
  });
  scene.add(target, source, means, new THREE.AxesHelper(0.05 * SCENE.extent), ...free);

  const controls = new THREE.OrbitControls(camera, renderer.domElement);
  const look = () => {
    controls.target.set(0, 0, 0);
    camera.position.set(-0.6, -0.6, 0.7).multiplyScalar(SCENE.extent);
    controls.update();
    draw();
  };
  let waiting = false;
  const render = () => renderer.render(scene, camera);
  const draw = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; render(); });
  };
  controls.addEventListener('change', draw);

  const resize = () => {
    const { clientWidth: width, clientHeight: height } = view;
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    draw();
  };
  window.addEventListener('resize', resize);

  const step = document.getElementById('step'), said = document.getElementById('said');
  const by = () => document.querySelector('input[name=by]:checked').value;
  const show = () => {
    const number = Number(step.value), byQ = by() === 'q';
    source.matrix.copy(poses[number]);
    source.matrixWorldNeedsUpdate = true;
    target.visible = source.visible = !byQ;
    means.visible = byQ;
    step.disabled = byQ;
    said.textContent = byQ ? 'at the result' : SCENE.names[number];
    draw();
  };
  step.addEventListener('input', show);
  document.querySelectorAll('input[name=by]').forEach(each => each.addEventListener('change', show));
  document.getElementById('home').addEventListener('click', look);

  resize();
  look();
  show();
  // for who measures: frames a second, each of them finished
  window.framesPerSecond = frames => {
    const pixel = new Uint8Array(4), gl = renderer.getContext(), begun = performance.now();
    for (let k = 0; k < frames; k++) {
      camera.position.applyAxisAngle(camera.up, 0.02);
      camera.lookAt(0, 0, 0);
      render();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    }
    return 1000 * frames / (performance.now() - begun);
  };
})();
