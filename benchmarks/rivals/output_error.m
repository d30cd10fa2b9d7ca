% Output error in GNU Octave: all flights of a Jacobian at once, one column each, so that no loop but that over time is left.
% Called with a folder that holds input.txt; writes answer.txt: seconds, then the unknowns and their deviations.
1;

function [ax, az, pitch] = forces(x, elevator, table, b)
  square = x(1,:).^2 + x(2,:).^2;
  alpha = atan2(x(2,:), x(1,:));
  qhat = x(3,:) * b.mean_chord / (2 * b.reference_speed);
  force = 0.5 * b.density * square * b.wing_area;
  terms = [ones(size(alpha)); alpha; qhat; elevator * ones(size(alpha)); alpha.^2; alpha.*qhat; alpha*elevator; ...
           qhat.^2; qhat*elevator; elevator^2 * ones(size(alpha))];
  ax = (force .* sum(table.x .* terms, 1) + b.thrust) / b.mass;
  az = force .* sum(table.z .* terms, 1) / b.mass;
  pitch = force .* sum(table.m .* terms, 1) * b.mean_chord / b.I_yy;
end

function dx = rates(x, elevator, table, b)
  [ax, az, pitch] = forces(x, elevator, table, b);
  s = sin(x(4,:)); c = cos(x(4,:));
  dx = [ax - 9.80665 * s - x(3,:) .* x(2,:); az + 9.80665 * c + x(3,:) .* x(1,:); pitch; x(3,:); ...
        x(1,:) .* s - x(2,:) .* c];
end

function residuals = flights(unknown, d)
  count = numel(d.places);
  full = zeros(30, columns(unknown));
  full(d.places, :) = unknown(1:count, :);
  table.x = full(1:10, :); table.z = full(11:20, :); table.m = full(21:30, :);
  x = unknown(count+1:end, :);
  samples = numel(d.time);
  residuals = zeros(7, samples, columns(unknown));
  for k = 1:samples
    [ax, az] = forces(x, d.elevator(k), table, d.body);
    residuals(:, k, :) = [hypot(x(1,:), x(2,:)); atan2(x(2,:), x(1,:)); x(3,:); x(4,:); ax; az; x(5,:)];
    if k < samples
      dt = d.time(k+1) - d.time(k);
      middle = 0.5 * (d.elevator(k) + d.elevator(k+1));
      k1 = rates(x, d.elevator(k), table, d.body);
      k2 = rates(x + 0.5 * dt * k1, middle, table, d.body);
      k3 = rates(x + 0.5 * dt * k2, middle, table, d.body);
      k4 = rates(x + dt * k3, d.elevator(k+1), table, d.body);
      x = x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    end
  end
  residuals = reshape((residuals - d.measured) .* d.weight, 7 * samples, columns(unknown));
end

function [unknown, deviation] = fit(d)
  unknown = d.start;
  n = numel(unknown);
  r = flights(unknown, d);
  cost = r' * r;
  for k = 1:50
    h = 1e-6 * d.size;
    J = (flights(unknown + full(diag(h)), d) - r) ./ (h ./ d.size)';
    step = -(J \ r);
    share = 1;
    for halved = 1:20
      tried = unknown + share * d.size .* step;
      beside = flights(tried, d);
      found = beside' * beside;
      if found <= cost
        break
      end
      share = share / 2;
    end
    gained = cost - found;
    if gained > 0
      unknown = tried; r = beside; cost = found;
    end
    if ! (gained > 1e-8 * cost)
      break
    end
  end
  deviation = d.size .* sqrt(diag(inv(J' * J)) * cost / (numel(r) - n));
end

folder = argv(){end};
given = dlmread(fullfile(folder, "input.txt"));
names = {"mass", "I_yy", "wing_area", "mean_chord", "reference_speed", "density", "thrust"};
samples = given(1); count = given(2); given = given(3:end);
for i = 1:7
  d.body.(names{i}) = given(i);
end
given = given(8:end);
d.weight = given(1:7); given = given(8:end);
d.places = given(1:count) + 1; given = given(count+1:end);
d.size = given(1:count+5); given = given(count+6:end);
d.start = given(1:count+5); given = given(count+6:end);
d.time = given(1:samples); given = given(samples+1:end);
d.elevator = given(1:samples); given = given(samples+1:end);
d.measured = reshape(given, 7, samples);
tic;
[unknown, deviation] = fit(d);
seconds = toc;
dlmwrite(fullfile(folder, "answer.txt"), [seconds; unknown; deviation], "precision", "%.17g");
